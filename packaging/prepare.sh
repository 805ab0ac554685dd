#!/usr/bin/env bash
# What scripts/release.sh needs on a machine of the workflow: targets and linkers; on macOS the tools of GNU.
set -euo pipefail
if [ "$(uname)" = Darwin ]; then
    rustup toolchain install stable --profile minimal --target x86_64-apple-darwin,aarch64-apple-darwin
    brew install coreutils gnu-tar gnu-sed bash
    for tool in coreutils gnu-tar gnu-sed; do echo "$(brew --prefix "$tool")/libexec/gnubin" >>"$GITHUB_PATH"; done
    echo "$(brew --prefix bash)/bin" >>"$GITHUB_PATH"
else
    rustup toolchain install stable --profile minimal \
        --target x86_64-unknown-linux-gnu,aarch64-unknown-linux-gnu,x86_64-unknown-linux-musl,aarch64-unknown-linux-musl,x86_64-pc-windows-gnu
    sudo apt-get update
    sudo apt-get install -y --no-install-recommends gcc-mingw-w64-x86-64
    pip install "maturin>=1.9,<2" ziglang cargo-zigbuild
fi
