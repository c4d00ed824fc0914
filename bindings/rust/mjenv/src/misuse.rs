//! Misuse that the compiler refuses. Each example fails with the error that it names; without its last line it would
//! compile.

/// Two threads use one environment.
/// ```compile_fail,E0277
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// std::thread::scope(|scope| {
///     scope.spawn(|| env.rows());
/// });
/// ```
pub struct NotSync;

/// A space borrows its bounds from the environment, so it cannot outlive it.
/// ```compile_fail,E0505
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let space = env.action_space();
/// drop(env);
/// println!("{}", space.low[0]);
/// ```
pub struct SpaceOutlives;

/// A field borrows its name from the environment, so it cannot outlive it.
/// ```compile_fail,E0597
/// let name = {
///     let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
///     env.fields(mjenv::Role::Info).next().unwrap().name
/// };
/// println!("{name}");
/// ```
pub struct FieldOutlives;

/// The environment's options cannot outlive it.
/// ```compile_fail,E0505
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let options = env.options();
/// drop(env);
/// println!("{}", options.schema().count());
/// ```
pub struct OptionsOutlive;

/// The environment's options cannot be changed.
/// ```compile_fail,E0596
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// env.options().set("strict", false).unwrap();
/// ```
pub struct OptionsOfEnv;

/// Outputs cannot be borrowed while the next step writes them.
/// ```compile_fail,E0502
/// let mut env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let mut batch = env.batch();
/// env.reset(&mut batch).unwrap();
/// let obs = batch.obs(0);
/// env.step(&[0.0f32; 2], &mut batch).unwrap();
/// println!("{}", obs[0]);
/// ```
pub struct OutputsWhileWritten;

/// The environment cannot be used after it was moved into a pipeline.
/// ```compile_fail,E0382
/// let mut env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let pipeline = env.pipeline();
/// env.seed(&[1]).unwrap();
/// ```
pub struct EnvInPipeline;

/// The outputs of a row cannot be borrowed while rows are sent.
/// ```compile_fail,E0502
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let mut pipeline = env.pipeline();
/// pipeline.reset().unwrap();
/// let row = pipeline.row(0).unwrap();
/// pipeline.send(&[0.0f32; 2]).unwrap();
/// println!("{}", row.obs()[0]);
/// ```
pub struct RowWhileSent;

/// An environment cannot be cloned.
/// ```compile_fail,E0599
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let twin = env.clone();
/// ```
pub struct Copied;
