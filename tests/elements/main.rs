//! Finite elements against closed forms: form factors, the toy equation, constant radiance, and the
//! same numbers by every way of solving [theory A8, A9, A15–A17, B8–B10].

mod bound;
mod factors;
mod solve;
mod support;
mod view;
