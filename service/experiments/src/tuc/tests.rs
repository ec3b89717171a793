//! The format, and maps that hold.
