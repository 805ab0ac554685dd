//! Machines side by side compute what each computes alone, to the last bit: a whole detection, and one that comes to a bad
//! end.

mod detections;
mod ends;
