//! The format, line by line.
