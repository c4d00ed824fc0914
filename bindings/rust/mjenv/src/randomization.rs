use std::ptr;

use mjenv_sys as sys;

use crate::describe::{int64, size_of};
use crate::error::{check, Result};
use crate::text::c_string;
use crate::Env;

/// The distribution of a draw. Each is a method of NumPy's Generator.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum Distribution {
    /// `uniform(low, high)`
    Uniform {
        /// The lower bound.
        low: f64,
        /// The upper bound.
        high: f64,
    },
    /// `exp(uniform(log(low), log(high)))`
    LogUniform {
        /// The lower bound, which is positive.
        low: f64,
        /// The upper bound.
        high: f64,
    },
    /// `normal(mean, std)`
    Normal {
        /// The mean.
        mean: f64,
        /// The standard deviation.
        std: f64,
    },
    /// `normal(mean, std)`, drawn again until it lies between `low` and `high`.
    TruncatedNormal {
        /// The mean of the normal distribution.
        mean: f64,
        /// The standard deviation of the normal distribution.
        std: f64,
        /// The lower bound.
        low: f64,
        /// The upper bound.
        high: f64,
    },
    /// One of these values.
    Choice(Vec<f64>),
}

impl Distribution {
    fn raw(&self) -> (sys::mjenv_distribution, Vec<f64>) {
        match self {
            Self::Uniform { low, high } => (sys::MJENV_DISTRIBUTION_UNIFORM, vec![*low, *high]),
            Self::LogUniform { low, high } => (sys::MJENV_DISTRIBUTION_LOG_UNIFORM, vec![*low, *high]),
            Self::Normal { mean, std } => (sys::MJENV_DISTRIBUTION_NORMAL, vec![*mean, *std]),
            Self::TruncatedNormal { mean, std, low, high } => {
                (sys::MJENV_DISTRIBUTION_TRUNCATED_NORMAL, vec![*mean, *std, *low, *high])
            }
            Self::Choice(values) => (sys::MJENV_DISTRIBUTION_CHOICE, values.clone()),
        }
    }
}

/// How the draw gives the new value. The model's own value is the one that was loaded with the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum Effect {
    /// The value that is drawn.
    Value,
    /// The model's own value, times the one that is drawn.
    Scale,
    /// The model's own value, plus the one that is drawn.
    Offset,
}

impl Effect {
    fn raw(self) -> sys::mjenv_effect {
        match self {
            Self::Value => sys::MJENV_EFFECT_VALUE,
            Self::Scale => sys::MJENV_EFFECT_SCALE,
            Self::Offset => sys::MJENV_EFFECT_OFFSET,
        }
    }
}

/// A draw of resets for an array of the mjModel, see [`Env::randomize`].
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub struct Randomization {
    /// An array that [`Env::write`] can write: `"geom_friction"`, `"opt.gravity"`.
    pub array: String,
    /// How the draw gives the new value.
    pub effect: Effect,
    /// The distribution of the draw.
    pub distribution: Distribution,
    /// The numbers of the elements that are drawn, in the order of the draws; all by default.
    pub elements: Option<Vec<usize>>,
    /// Whether there is one draw for all elements, instead of one for each.
    pub shared: bool,
    /// Whether mj_setConst is called after the draws, which computes again what MuJoCo derives from masses and sizes.
    pub constants: bool,
    /// Whether element i takes the draw of element i of the item before, or its shared draw, and nothing is drawn. The
    /// distribution is then not used. See [`Randomization::same`].
    pub repeats: bool,
    /// Each draw is multiplied by it.
    pub factor: f64,
}

impl Randomization {
    /// One draw for each element of the array.
    #[must_use]
    pub fn new(array: &str, effect: Effect, distribution: Distribution) -> Self {
        Self {
            array: array.to_owned(),
            effect,
            distribution,
            elements: None,
            shared: false,
            constants: false,
            repeats: false,
            factor: 1.0,
        }
    }

    /// The draws of the item before, times a factor, for another array. For example, an actuator's kp is drawn for
    /// `actuator_gainprm`, and `actuator_biasprm` takes it with the factor -1.
    #[must_use]
    pub fn same(array: &str, effect: Effect, factor: f64) -> Self {
        let unused = Distribution::Choice(Vec::new());
        Self { repeats: true, factor, ..Self::new(array, effect, unused) }
    }
}

/// Pushes of a body at random times: a force, or a kick.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Push {
    /// The body's number, see [`Env::object_index`]; not 0, the world.
    pub body: usize,
    /// The fewest and the most steps from the reset, or the last step of a push, to the next push.
    pub every: (usize, usize),
    /// The lower bounds of the force (N) and the torque (N m), as in `xfrc_applied`; for a kick, of the six numbers that
    /// are added to `qvel` of the body's free joint (m/s, rad/s).
    pub low: [f64; 6],
    /// Their upper bounds.
    pub high: [f64; 6],
    /// Whether it is a kick, which changes the velocity before a step, and not a force.
    pub is_kick: bool,
    /// The fewest and the most steps that a force lasts; (0, 0): one.
    pub duration: (usize, usize),
}

/// Noise, delays and pushes, see [`Env::perturb`]. By default there are none.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Perturbation {
    /// The standard deviations of the action's noise: none, one for all actuators, or one for each.
    pub action_noise: Vec<f64>,
    /// The same for the observation.
    pub observation_noise: Vec<f64>,
    /// How many steps an action takes until it reaches the task.
    pub action_delay: usize,
    /// How many steps an observation takes until it reaches the caller.
    pub observation_delay: usize,
    /// The pushes: for each body at most one force and one kick.
    pub pushes: Vec<Push>,
    /// The action that the task gets until the first delayed action arrives: zeros if this is empty, one number for all
    /// actuators, or one for each.
    pub first_action: Vec<f64>,
    /// 0: the delay is `action_delay`. Else it is drawn: `integers(action_delay, max_action_delay + 1)`.
    pub max_action_delay: usize,
    /// The same for the observation.
    pub max_observation_delay: usize,
    /// Whether such delays are drawn anew for each step, and not at each reset.
    pub redraws_delays: bool,
}

impl Env {
    /// Replaces the draws of resets, also of automatic ones, from each row's next reset on. A reset makes them in the order
    /// of the list from the row's random stream, after the task's own draws. With an empty list, nothing is drawn. Later,
    /// `env.write(&rows, "draws[0]", &[low, high])` changes the parameters of the first item for some rows.
    ///
    /// ```
    /// # fn main() -> Result<(), mjenv::Error> {
    /// use mjenv::{Distribution, Effect, Env, Options, Randomization};
    ///
    /// let mut env = Env::new(&Options::new("Hopper-v5")?, 2)?;
    /// let scale = Distribution::Uniform { low: 0.5, high: 1.5 };
    /// env.randomize(&[Randomization::new("geom_friction", Effect::Scale, scale)])?;
    /// let mut batch = env.batch::<f64>();
    /// env.reset(.., &mut batch)?;
    /// assert_ne!(env.read(0, "geom_friction")?, env.read(1, "geom_friction")?);
    /// # Ok(())
    /// # }
    /// ```
    ///
    /// # Errors
    /// [`ErrorKind::Name`](crate::ErrorKind::Name) (an array), [`ErrorKind::Value`](crate::ErrorKind::Value) (an
    /// element, a parameter, or a value that can be drawn), [`ErrorKind::Size`](crate::ErrorKind::Size). After an error
    /// nothing has changed.
    pub fn randomize(&mut self, items: &[Randomization]) -> Result<()> {
        let mut kept = Vec::with_capacity(items.len());
        for item in items {
            let name = c_string(format_args!("array {:?}", item.array), &item.array)?;
            let elements: Option<Vec<i64>> = item.elements.as_ref().map(|all| all.iter().map(|i| int64(*i)).collect());
            kept.push((name, elements, item.distribution.raw()));
        }
        let raw: Vec<_> = items
            .iter()
            .zip(&kept)
            .map(|(item, (name, elements, (distribution, parameters)))| sys::mjenv_randomization {
                struct_size: size_of::<sys::mjenv_randomization>(),
                distribution: *distribution,
                array: name.as_ptr(),
                elements: elements.as_ref().map_or(ptr::null(), |all| all.as_ptr()),
                element_count: elements.as_ref().map_or(0, |all| int64(all.len())),
                parameters: parameters.as_ptr(),
                parameter_count: int64(parameters.len()),
                effect: item.effect.raw(),
                shared: item.shared.into(),
                constants: item.constants.into(),
                repeats: item.repeats.into(),
                factor: item.factor,
            })
            .collect();
        // SAFETY: all pointers are valid for the call, which copies what they point to.
        check(unsafe { sys::mjenv_randomize(self.raw(), raw.as_ptr(), int64(raw.len())) })
    }

    /// Ends the present noise, delays and pushes at once; the new ones act on each row from its next reset on.
    /// docs/randomisation.md describes what happens in a step.
    ///
    /// # Errors
    /// [`ErrorKind::Value`](crate::ErrorKind::Value), [`ErrorKind::Size`](crate::ErrorKind::Size). After an error
    /// nothing has changed.
    pub fn perturb(&mut self, perturbation: &Perturbation) -> Result<()> {
        let pushes: Vec<_> = perturbation
            .pushes
            .iter()
            .map(|push| sys::mjenv_push {
                struct_size: size_of::<sys::mjenv_push>(),
                body: i32::try_from(push.body).unwrap_or(i32::MAX),
                min_steps: int64(push.every.0),
                max_steps: int64(push.every.1),
                low: push.low,
                high: push.high,
                is_kick: push.is_kick.into(),
                reserved: 0,
                min_duration: int64(push.duration.0),
                max_duration: int64(push.duration.1),
            })
            .collect();
        let raw = sys::mjenv_perturbation {
            struct_size: size_of::<sys::mjenv_perturbation>(),
            reserved: 0,
            action_noise: perturbation.action_noise.as_ptr(),
            action_noise_count: int64(perturbation.action_noise.len()),
            observation_noise: perturbation.observation_noise.as_ptr(),
            observation_noise_count: int64(perturbation.observation_noise.len()),
            action_delay: int64(perturbation.action_delay),
            observation_delay: int64(perturbation.observation_delay),
            pushes: pushes.as_ptr(),
            push_count: int64(pushes.len()),
            first_action: perturbation.first_action.as_ptr(),
            first_action_count: int64(perturbation.first_action.len()),
            max_action_delay: int64(perturbation.max_action_delay),
            max_observation_delay: int64(perturbation.max_observation_delay),
            redraws_delays: perturbation.redraws_delays.into(),
            reserved_end: 0,
        };
        // SAFETY: all pointers are valid for the call, which copies what they point to.
        check(unsafe { sys::mjenv_perturb(self.raw(), &raw) })
    }
}
