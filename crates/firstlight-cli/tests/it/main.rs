//! The built program, from outside: each test is named by what it promises.

mod answers;
mod batch;
#[cfg(unix)]
mod book;
mod buffers;
mod coco;
mod common;
mod compare;
mod faults;
mod files;
mod found;
mod frames;
mod hostile_models;
mod motion;
mod pictures;
mod relight;
mod several;
#[cfg(unix)]
mod signals;
mod streams;
mod usage;
mod view_buffer;
