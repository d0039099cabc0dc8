//! The built program, from outside: each test is named by what it promises.

mod answers;
mod common;
mod faults;
mod files;
mod frames;
mod pictures;
#[cfg(unix)]
mod signals;
mod streams;
mod usage;
