"""What is written in Rust."""

import os
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

__version__: str

class Error(ValueError): ...

class Table:
    def keys(self) -> list[str]: ...
    def __len__(self) -> int: ...
    def __contains__(self, name: str, /) -> bool: ...
    def __getitem__(self, name: str, /) -> npt.NDArray[Any]: ...
    def __arrow_c_stream__(self, requested_schema: object | None = None) -> object: ...
    def parts(self) -> tuple[int, list[tuple[str, str, bytes, bytes]]]: ...
    @staticmethod
    def of_parts(rows: int, columns: Sequence[tuple[str, str, bytes, bytes]]) -> Table: ...

_Progress = Callable[[int, int], object] | bool | None

def command(
    words: Sequence[str | os.PathLike[str]],
    scenario: tuple[str | os.PathLike[str], str] | None = None,
    files: bool = False,
    progress: _Progress = None,
) -> tuple[int, str, list[tuple[str, Table]]]: ...
def detect(
    words: Sequence[str | os.PathLike[str]],
    scenario: tuple[str | os.PathLike[str], str] | None,
    make: Callable[[], object],
    detector: str,
    progress: _Progress = None,
) -> tuple[str, Table]: ...
