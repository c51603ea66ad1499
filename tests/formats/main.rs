//! Files in and out: every format read and written from small files made here, and what broken
//! files get.

mod broken;
mod decode;
mod exr;
mod images;
mod mitsuba;
mod mitsuba_errors;
mod mitsuba_hostile;
mod mitsuba_manual;
mod mitsuba_suite;
mod obj;
mod peers;
mod ply;
mod serialized;
mod write;
