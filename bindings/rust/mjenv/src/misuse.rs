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
/// let mut batch = env.batch::<f64>();
/// env.reset(.., &mut batch).unwrap();
/// let obs = batch.obs(0);
/// env.step(.., &[0.0f32; 2], &mut batch).unwrap();
/// println!("{}", obs[0]);
/// ```
pub struct OutputsWhileWritten;

/// Outputs cannot be borrowed while rows are received into them.
/// ```compile_fail,E0502
/// let mut env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let (mut batch, mut rows) = (env.batch::<f64>(), Vec::new());
/// env.reset(.., &mut batch).unwrap();
/// env.send(.., &[0.0f32; 2]).unwrap();
/// let obs = batch.obs(0);
/// env.recv(1, None, &mut rows, &mut batch).unwrap();
/// println!("{}", obs[0]);
/// ```
pub struct OutputsWhileReceived;

/// An environment cannot be cloned.
/// ```compile_fail,E0599
/// let env = mjenv::Env::new(&mjenv::Options::new("Reacher-v5").unwrap(), 1).unwrap();
/// let twin = env.clone();
/// ```
pub struct Copied;
