//! Machines side by side compute what each computes alone, to the last bit: one step, a whole detection, and one that
//! comes to a bad end.

mod bank;
mod detections;
mod ends;
