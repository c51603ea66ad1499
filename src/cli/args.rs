//! What can be written on the command line.

use super::units;
use crate::render::layers::Joins;
use crate::report::comparison::Metric;
use clap::{Args, Parser, Subcommand, ValueEnum, ValueHint};
use std::path::PathBuf;
use std::time::Duration;

/// A bidirectional renderer: light and potential as one measurement.
#[derive(Debug, Parser)]
#[command(name = "nephroid", version, arg_required_else_help = true, after_help = EXIT_CODES)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

const EXIT_CODES: &str = "\
Exit codes: 0 done; 1 no (images differ, a test fails); 2 usage or scene error; 4 output error;
130 interrupted, with the image so far written.
Data goes to standard output, everything else to standard error.";

/// The subcommands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Render a scene.
    Render(Box<RenderArgs>),
    /// Read and build a scene, report every problem, render nothing.
    Check(SceneArgs),
    /// Say what is in a scene: shapes, triangles, bounds, emitters, memory.
    Info(InfoArgs),
    /// Say how an image differs from a reference.
    Compare(CompareArgs),
    /// Run estimators side by side on scenes and say which finds the light how fast, as a page.
    Bench(BenchArgs),
    /// Test on a scene that both equations measure the same, for every number of scatterings.
    Adjoint(AdjointArgs),
    /// Test on a scene that L = Lᵉ + τL and W = Wᵉ + τ'W, at random points.
    Residual(ResidualArgs),
    /// Test this program against closed forms, in one table.
    Selfcheck(SelfcheckArgs),
    /// Show the strongest paths of a pixel, with the densities and weights of every join.
    Explain(ExplainArgs),
}

/// How to read a scene.
#[derive(Clone, Debug, Args)]
pub struct SceneArgs {
    /// Scene file (Mitsuba 3 XML).
    #[arg(value_name = "SCENE.xml", value_hint = ValueHint::FilePath)]
    pub scene: PathBuf,
    /// Value for `$name` in the scene; stronger than its `<default>` (repeatable).
    #[arg(short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = units::define)]
    pub define: Vec<(String, String)>,
    /// Which of several sensors, by its id or its number from 0.
    #[arg(long, value_name = "ID|N")]
    pub sensor: Option<String>,
    /// Read no file outside of this directory.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub sandbox: Option<PathBuf>,
    /// Threads [default: all that the machine has].
    #[arg(short = 't', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}

/// Estimators by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum EstimatorName {
    /// From the sensor: the rendering equation (path tracing).
    Gather,
    /// From the lights: the potential equation (light tracing).
    Shoot,
    /// Both, joined wherever they meet and weighted.
    Bidirectional,
    /// What a pilot finds best for the scene, merges included (consistent).
    #[default]
    Auto,
    /// What the scene's integrator element asks for.
    Scene,
    /// Lights alone, no coupling between surfaces.
    Local,
    /// The same without shadows.
    LocalUnshadowed,
    /// Ideal reflections and refractions followed, everything else lit by lights alone (recursive ray tracing).
    Recursive,
    /// Diffuse scenes as a matrix equation, solved by elimination.
    Invert,
    /// Diffuse scenes as a matrix equation, solved by --iteration.
    Iterate,
}

/// Iterations by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum IterationName {
    /// All elements gather at once.
    #[default]
    Jacobi,
    /// One element after another gathers.
    GaussSeidel,
    /// The element with the most unshot flux shoots.
    Southwell,
    /// Rays instead of a matrix, for very many elements.
    Stochastic,
}

/// How elements are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum ElementViewName {
    /// What arrives is interpolated, textures are exact.
    #[default]
    Smooth,
    /// One colour for each element: the solution itself.
    Flat,
}

/// Where elements are small.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SubdivisionName {
    /// Where radiance varies.
    #[default]
    Adaptive,
    /// Nowhere.
    Uniform,
}

/// Joins of walks by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TechniqueName {
    /// A gathering walk arrives on a light.
    Hit,
    /// A light point is picked from a gathering vertex.
    #[value(alias = "next-event")]
    Nee,
    /// A shooting vertex is seen by the sensor.
    Splat,
    /// A gathering vertex is joined to a shooting vertex.
    Connect,
    /// Vertices of both walkers near each other count as one, where mirrors or smooth glass throw light; consistent.
    Merge,
}

/// Heuristics of multiple importance sampling by name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum HeuristicName {
    /// Weights in proportion to densities.
    Balance,
    /// Weights in proportion to squared densities.
    Power,
}

/// Samplers by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub enum SamplerName {
    /// First decisions from Owen-scrambled Sobol sequences.
    #[default]
    Stratified,
    /// All decisions independent.
    Independent,
}

/// How to render.
#[derive(Clone, Debug, Args)]
pub struct RenderArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Image to write: .exr (linear, with variance) or .png; of finite elements also .ply (repeatable).
    #[arg(short, long = "output", value_name = "OUT", required = true, value_hint = ValueHint::FilePath)]
    pub output: Vec<PathBuf>,
    /// Which equation to expand.
    #[arg(short, long, value_enum, value_name = "NAME", default_value_t)]
    pub estimator: EstimatorName,
    /// Samples per pixel [default: the scene's, or 64; without end if only --time is given]; --estimator auto may give
    /// pixels where they vary more several in each pass.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub spp: Option<u64>,
    /// Time to take, pilot included, such as 20s or 5m; the sample, or pair of samples, that ends closest to it is the last.
    #[arg(long, value_name = "TIME", value_parser = units::duration)]
    pub time: Option<Duration>,
    /// Seed of all random numbers [default: the scene's, or 0].
    #[arg(long, value_name = "N")]
    pub seed: Option<u64>,
    /// Size of the film instead of the scene's, such as 640x480.
    #[arg(long, value_name = "WxH", value_parser = units::size)]
    pub size: Option<[u32; 2]>,
    /// Render only this window of the film.
    #[arg(long, value_name = "X,Y,W,H", value_parser = units::crop)]
    pub crop: Option<[u32; 4]>,
    /// Stops by which a PNG is brighter or darker; its curve is sRGB's.
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    pub exposure: f32,
    /// No progress, notes or warnings.
    #[arg(short, long)]
    pub quiet: bool,
    /// Write figures about the render as JSON.
    #[arg(long, value_name = "FILE.json", value_hint = ValueHint::FilePath)]
    pub stats: Option<PathBuf>,
    /// Most memory that the film may take [default: what the machine has free].
    #[arg(long, value_name = "SIZE", value_parser = units::memory)]
    pub max_memory: Option<u64>,
    /// Transport.
    #[command(flatten, next_help_heading = "Transport")]
    pub transport: TransportArgs,
    /// Layers.
    #[command(flatten, next_help_heading = "Layers")]
    pub layers: LayersArgs,
    /// Finite elements.
    #[command(flatten, next_help_heading = "Finite elements (--estimator invert, iterate)")]
    pub elements: ElementsArgs,
}

/// How to take the image apart.
#[derive(Clone, Debug, Args)]
pub struct LayersArgs {
    /// Write the terms n = 0, 1, … N of the Neumann series (n scatterings; the last with all beyond) as
    /// layers of .exr outputs; they sum to the image [default N: 8].
    #[arg(long, value_name = "N", num_args = 0..=1, require_equals = true, value_parser = clap::value_parser!(u32).range(0..=255))]
    pub layers: Option<Option<u32>>,
    /// Write a contact sheet of the terms and of their partial sums.
    #[arg(long, value_name = "OUT.png", value_hint = ValueHint::FilePath)]
    pub gallery: Option<PathBuf>,
    /// Write the image of what --estimator local or recursive leaves out of the full solution.
    #[arg(long, value_name = "OUT", value_hint = ValueHint::FilePath)]
    pub left_out: Option<PathBuf>,
    /// Write into this directory what every join adds to every path length, raw and weighted: images, a
    /// table and contact sheets.
    #[arg(long, value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub pyramid: Option<PathBuf>,
    /// Longest paths that the pyramid shows apart.
    #[arg(long, value_name = "N", default_value_t = 6, value_parser = clap::value_parser!(u32).range(1..=i64::from(Joins::LONGEST)))]
    pub pyramid_length: u32,
    /// Write what every light adds as layers of .exr outputs; GROUPS such as 'lamps=desk,lamp*;sky=env'
    /// name emitters by their ids.
    #[arg(long, value_name = "GROUPS", num_args = 0..=1, require_equals = true)]
    pub light_groups: Option<Option<String>>,
}

/// Into which elements surfaces are cut, and how their equation is solved.
#[derive(Clone, Debug, Args)]
pub struct ElementsArgs {
    /// Most elements; at least one for each side of a triangle that reflects or emits.
    #[arg(long = "elements", value_name = "N", default_value_t = 4000, value_parser = clap::value_parser!(u32).range(1..))]
    pub count: u32,
    /// Where elements are small.
    #[arg(long, value_enum, value_name = "NAME", default_value_t)]
    pub subdivision: SubdivisionName,
    /// Subdivide no further than to this relative error bound.
    #[arg(long, value_name = "E", value_parser = positive)]
    pub element_error: Option<f64>,
    /// Rays from each element on average.
    #[arg(long, value_name = "N", default_value_t = 1024, value_parser = clap::value_parser!(u32).range(1..))]
    pub element_rays: u32,
    /// How to iterate.
    #[arg(long, value_enum, value_name = "NAME", default_value_t)]
    pub iteration: IterationName,
    /// Most iterations [default: 64 stochastic ones, else 10000].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub iterations: Option<u32>,
    /// Iterate until this share of the sources' flux is left as residual.
    #[arg(long, value_name = "R", default_value_t = 1e-10, value_parser = positive)]
    pub residual: f64,
    /// Between the elements: nothing, or interpolated.
    #[arg(long, value_enum, value_name = "NAME", default_value_t)]
    pub element_view: ElementViewName,
    /// Write the residual after every iteration.
    #[arg(long, value_name = "FILE.csv", value_hint = ValueHint::FilePath)]
    pub residual_log: Option<PathBuf>,
}

/// Where paths are cut off.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MaxLength {
    /// After so many edges.
    Edges(u32),
    /// Where little is left.
    Auto,
}

/// Which paths, by which joins.
#[derive(Clone, Debug, Args)]
pub struct TransportArgs {
    /// Joins that are allowed, instead of the estimator's.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST")]
    pub techniques: Option<Vec<TechniqueName>>,
    /// How joins share a path [default: balance for --estimator auto, else power].
    #[arg(long, value_enum, value_name = "NAME")]
    pub heuristic: Option<HeuristicName>,
    /// Shortest path in edges (1 = a lamp seen directly).
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub min_length: u32,
    /// Longest path in edges, or `auto`: as long as --truncation asks for [default: the scene's max_depth].
    #[arg(long, value_name = "N|auto", value_parser = units::max_length)]
    pub max_length: Option<MaxLength>,
    /// What may be lost by the longest path, as a share.
    #[arg(long, value_name = "E", default_value_t = 1e-3, value_parser = positive)]
    pub truncation: f64,
    /// Only paths of a class, such as 'E D S+ L' or 'visible-to:gather,shoot'.
    #[arg(long, value_name = "EXPR")]
    pub paths: Option<String>,
    /// Light paths per pass [default: one per pixel].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub light_paths: Option<u32>,
    /// Connections from each gathering vertex.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub connections: u32,
    /// What the pilot of --estimator auto chose: read where FILE exists, else written to it.
    #[arg(long, value_name = "FILE", value_hint = ValueHint::FilePath)]
    pub plan: Option<PathBuf>,
    /// Let light start as the lamps emit it, not where a pilot found that it matters
    #[arg(long)]
    pub no_guide: bool,
    /// Let gathering walks go where a pilot found that light comes from; --estimator auto decides so where it pays
    #[arg(long, conflicts_with = "no_guide")]
    pub guide_gathering: bool,
    /// Let a walk through glass choose at random which way it looks for lamps, instead of following all
    #[arg(long)]
    pub no_branching: bool,
    /// One gathering walk per pixel and pass, not more where the pilot of --estimator auto found that they vary more
    #[arg(long)]
    pub no_adaptive: bool,
    /// How walks draw: evenly spread over their first decisions (the variance that the image reports is
    /// then an upper bound), or independently of each other
    #[arg(long, value_enum, default_value_t, value_name = "NAME")]
    pub sampler: SamplerName,
}

/// What to say about a scene.
#[derive(Clone, Debug, Args)]
pub struct InfoArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// What to compare.
#[derive(Clone, Debug, Args)]
pub struct CompareArgs {
    /// The image to be judged.
    #[arg(value_name = "IMAGE", value_hint = ValueHint::FilePath)]
    pub image: PathBuf,
    /// What it should look like.
    #[arg(value_name = "REFERENCE", value_hint = ValueHint::FilePath)]
    pub reference: PathBuf,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
    /// Exit with 1 where the metric is beyond this (for welch: its p below this).
    #[arg(long, value_name = "X", value_parser = finite)]
    pub tolerance: Option<f64>,
    /// What the tolerance is about.
    #[arg(long, value_enum, default_value_t, requires = "tolerance")]
    pub metric: Metric,
}

fn positive(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite() && *v > 0.0).ok_or_else(|| "expected a number above 0".into())
}

fn finite(text: &str) -> Result<f64, String> {
    text.parse().ok().filter(|v: &f64| v.is_finite() && *v >= 0.0).ok_or_else(|| "expected a number of at least 0".into())
}

/// How to compare both walkers.
#[derive(Clone, Debug, Args)]
pub struct AdjointArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// How much.
    #[command(flatten)]
    pub effort: ProofArgs,
    /// Only paths of a class, such as 'E D S+ L', of those that both walkers can make.
    #[arg(long, value_name = "EXPR")]
    pub paths: Option<String>,
    /// Longest path in edges [default: the scene's max_depth, or 16].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub max_length: Option<u32>,
    /// Size of the film [default: the scene's, at most 96 pixels a side].
    #[arg(long, value_name = "WxH", value_parser = units::size)]
    pub size: Option<[u32; 2]>,
    /// Every class of paths by the events beside eye and light (D wide, G narrow, S Dirac).
    #[arg(long)]
    pub classes: bool,
    /// The test of every block.
    #[arg(long)]
    pub blocks: bool,
}

/// Where and how much to test both equations.
#[derive(Clone, Debug, Args)]
pub struct ResidualArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// How much; a pass is a walk from every point.
    #[command(flatten)]
    pub effort: ProofArgs,
    /// Random points of each equation.
    #[arg(long, value_name = "N", default_value_t = 128, value_parser = clap::value_parser!(u32).range(1..=100_000))]
    pub points: u32,
    /// Longest path in edges from a point on [default: the scene's max_depth, or 12].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1000))]
    pub max_length: Option<u32>,
    /// The test of every point.
    #[arg(long)]
    pub each: bool,
}

/// What to test the program with.
#[derive(Clone, Debug, Args)]
pub struct SelfcheckArgs {
    /// Instead, test that radiance is constant around this mesh (.obj, .ply, .serialized) in a closed scene.
    #[arg(long, value_name = "MESH", value_hint = ValueHint::FilePath)]
    pub mesh: Option<PathBuf>,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
    /// Threads [default: all that the machine has].
    #[arg(short = 't', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
}

/// Which pixel to explain.
#[derive(Clone, Debug, Args)]
pub struct ExplainArgs {
    /// The scene.
    #[command(flatten)]
    pub scene: SceneArgs,
    /// Column and row in the film, from the upper left corner.
    #[arg(long, value_name = "X,Y", value_parser = units::pixel)]
    pub pixel: (u32, u32),
    /// Samples of the pixel, each with a thousand light paths.
    #[arg(long, value_name = "N", default_value_t = 256, value_parser = clap::value_parser!(u64).range(2..))]
    pub spp: u64,
    /// Paths to show.
    #[arg(long, value_name = "N", default_value_t = 8, value_parser = clap::value_parser!(u32).range(..=10_000))]
    pub show: u32,
    /// Size of the film instead of the scene's, such as 640x480.
    #[arg(long, value_name = "WxH", value_parser = units::size)]
    pub size: Option<[u32; 2]>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// How much a statistical test does.
#[derive(Clone, Debug, Args)]
pub struct ProofArgs {
    /// Independent draws of each side.
    #[arg(long, value_name = "N", default_value_t = 64, value_parser = clap::value_parser!(u32).range(8..=10_000))]
    pub renders: u32,
    /// Passes per draw [default: as many as the test needs, within --time].
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    pub passes: Option<u64>,
    /// Time after which no passes are added [default: 60s].
    #[arg(long, value_name = "TIME", value_parser = units::duration, conflicts_with = "passes")]
    pub time: Option<Duration>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// As JSON.
    #[arg(long)]
    pub json: bool,
}

/// What to run side by side.
#[derive(Clone, Debug, Args)]
pub struct BenchArgs {
    /// Scene files (Mitsuba 3 XML).
    #[arg(value_name = "SCENE.xml", required = true, value_hint = ValueHint::FilePath)]
    pub scenes: Vec<PathBuf>,
    /// Directory for index.html, report.json and report.csv.
    #[arg(short, long = "output", value_name = "DIR", value_hint = ValueHint::DirPath)]
    pub output: PathBuf,
    /// Estimators.
    #[arg(short, long, value_delimiter = ',', value_name = "LIST", default_value = "gather,shoot,bidirectional")]
    pub estimators: Vec<String>,
    /// A renderer that is not ours, on the same files: `mitsuba[:variant[:integrator]]`, or on a translation of them:
    /// `luxcore[:engine]`, `cycles[:integrator]` (repeatable).
    #[arg(long, value_name = "PEER")]
    pub peer: Vec<String>,
    /// Times at which errors are compared, such as 5s,20s; runs end at the longest [default: 5s].
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = units::duration, conflicts_with = "spp")]
    pub time: Vec<Duration>,
    /// The same in samples per pixel.
    #[arg(long, value_delimiter = ',', value_name = "LIST", value_parser = clap::value_parser!(u64).range(1..))]
    pub spp: Option<Vec<u64>>,
    /// Runs of each, interleaved; with one there are no intervals and no ratios.
    #[arg(long, value_name = "N", default_value_t = 3, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub runs: u32,
    /// Image to take errors from [default: made once and kept beside the scene].
    #[arg(long, value_name = "REF.exr", value_hint = ValueHint::FilePath)]
    pub reference: Option<PathBuf>,
    /// Relative standard error wanted of a reference that has to be made.
    #[arg(long, value_name = "E", default_value_t = 0.02, value_parser = positive)]
    pub reference_error: f64,
    /// Time after which a reference is taken as it is [default: that of 12 runs].
    #[arg(long, value_name = "TIME", value_parser = units::duration)]
    pub reference_time: Option<Duration>,
    /// Size of the films instead of the scenes', such as 320x240.
    #[arg(long, value_name = "WxH", value_parser = units::size)]
    pub size: Option<[u32; 2]>,
    /// Seed of all random numbers.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// Value for `$name` in the scenes (repeatable).
    #[arg(short = 'D', long = "define", value_name = "NAME=VALUE", value_parser = units::define)]
    pub define: Vec<(String, String)>,
    /// Threads [default: all that the machine has].
    #[arg(short = 't', long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=4096))]
    pub threads: Option<u32>,
    /// Say nothing but errors.
    #[arg(short, long)]
    pub quiet: bool,
}
