//! Nothing allocates inside a walk: all joins, all kinds of lights, sensors and local models.
#![allow(unsafe_code)]

#[path = "physics/scenes.rs"]
#[allow(dead_code)]
mod scenes;
#[path = "physics/support.rs"]
#[allow(dead_code)]
mod support;

use glam::Vec2;
use nephroid::math::Random;
use nephroid::math::random::Family;
use nephroid::render::{Estimator, Options, Render};
use nephroid::transport::cache::LightCache;
use nephroid::transport::gather::gather;
use nephroid::transport::settings::Techniques;
use nephroid::transport::shoot::shoot;
use nephroid::transport::walk::{Context, Tally};
use nephroid::transport::{Contribution, RayCounts, Record};
use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    static COUNT: Cell<u64> = const { Cell::new(0) };
}

/// Counts what a thread asks for.
struct Counting;

// SAFETY: hands everything on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, at: *mut u8, layout: Layout) {
        unsafe { System.dealloc(at, layout) }
    }
    unsafe fn realloc(&self, at: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        COUNT.set(COUNT.get() + 1);
        unsafe { System.realloc(at, layout, size) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// Adds up what is found.
#[derive(Default)]
struct Sum(f64);

impl Record for Sum {
    fn gathered(&mut self, c: Contribution) {
        self.0 += f64::from(c.value.mean());
    }
    fn splatted(&mut self, _: Vec2, _: &mut Random, c: Contribution) {
        self.0 += f64::from(c.value.mean());
    }
}

#[test]
fn walks_do_not_allocate() {
    let dir = tempfile::tempdir().unwrap();
    for s in scenes::all(dir.path()) {
        let world = support::scene(&s.xml);
        let mut options = Options::for_scene(&world, Estimator::Bidirectional);
        options.settings.techniques = Techniques::ALL;
        let render = Render::new(&world, &options).unwrap();
        let cx = Context::new(&world, render.plan(), 0);
        let (mut sum, mut rays) = (Sum::default(), RayCounts::default());
        let mut vertices = Vec::with_capacity(1 << 16);
        let before = COUNT.get();
        let mut tally = Tally { record: &mut sum, rays: &mut rays, observe: &mut () };
        for i in 0..2000 {
            let mut random = Random::new(Family::Shoot, i, 0, 0).with_point(Family::Shoot, 0, i, 0, 8);
            shoot(cx, Some(&mut vertices), &mut random, &mut tally);
        }
        let shot = COUNT.get() - before;
        assert!(vertices.len() < 1 << 16);
        let cache = LightCache::new(vec![vertices], render.plan().merge_radius(0));
        let (width, height) = (world.film.width as f32, world.film.height as f32);
        let before = COUNT.get();
        let mut tally = Tally { record: &mut sum, rays: &mut rays, observe: &mut () };
        for i in 0..2000 {
            let mut random = Random::new(Family::Gather, i, 0, 0).with_point(Family::Gather, i, 0, 0, 16);
            let raster = random.unit2() * Vec2::new(width, height);
            gather(cx, raster, 1.0, &cache, &mut random, &mut tally);
        }
        assert_eq!((shot, COUNT.get() - before), (0, 0), "{}", s.name);
        assert!(sum.0 > 0.0 && rays.total() > 4000, "{}", s.name);
    }
}
