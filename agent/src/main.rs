//! `descry`: the command line.

fn main() {}
