//! What the compiler refuses. Each example fails with the error that it names, and would compile without its last line.

/// Two threads in one environment.
/// ```compile_fail,E0277
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// std::thread::scope(|scope| {
///     scope.spawn(|| env.rows());
/// });
/// ```
pub struct NotSync;

/// A space, whose bounds are the environment's, after the environment.
/// ```compile_fail,E0505
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let space = env.action_space();
/// drop(env);
/// println!("{}", space.low[0]);
/// ```
pub struct SpaceOutlives;

/// A field's name after the environment.
/// ```compile_fail,E0597
/// let name = {
///     let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
///     env.fields(mjenv::Role::Info).next().unwrap().name
/// };
/// println!("{name}");
/// ```
pub struct FieldOutlives;

/// The environment's own options after it.
/// ```compile_fail,E0505
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let options = env.options();
/// drop(env);
/// println!("{}", options.schema().count());
/// ```
pub struct OptionsOutlive;

/// The environment's own options cannot be set.
/// ```compile_fail,E0596
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// env.options().set("strict", false).unwrap();
/// ```
pub struct OptionsOfEnv;

/// Outputs that are read while the next step writes them.
/// ```compile_fail,E0502
/// let mut env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let mut batch = env.batch();
/// env.reset(&mut batch).unwrap();
/// let obs = batch.obs(0);
/// env.step(&[0.0f32; 2], &mut batch).unwrap();
/// println!("{}", obs[0]);
/// ```
pub struct OutputsWhileWritten;

/// The environment beside the pipeline that it went into.
/// ```compile_fail,E0382
/// let mut env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let pipeline = env.pipeline();
/// env.seed(&[1]).unwrap();
/// ```
pub struct EnvInPipeline;

/// A row of a pipeline while rows are sent.
/// ```compile_fail,E0502
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let mut pipeline = env.pipeline();
/// pipeline.reset().unwrap();
/// let row = pipeline.row(0).unwrap();
/// pipeline.send(&[0.0f32; 2]).unwrap();
/// println!("{}", row.obs()[0]);
/// ```
pub struct RowWhileSent;

/// A copy of a handle.
/// ```compile_fail,E0599
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let twin = env.clone();
/// ```
pub struct Copied;
