//! Hopper-v5, written outside of the library in Rust.

use mjenv::numpy::clip;
use mjenv::task::*;

pub struct Hopper {
    forward_reward_weight: f64,
    ctrl_cost_weight: f64,
    healthy_reward: f64,
    survive_type: Dtype,
    terminate_when_unhealthy: bool,
    state_range: [f64; 2],
    z_range: [f64; 2],
    angle_range: [f64; 2],
    noise: f64,
    skipped: usize,
    x_before: Carry<1>,
}

fn within(value: f64, [low, high]: [f64; 2]) -> bool {
    low < value && value < high
}

impl Task for Hopper {
    const ID: &'static str = "RustHopper-v5";
    const MODEL: Model = Model::File("hopper.xml");
    const FRAME_SKIP: u32 = 4;
    const TIME_LIMIT: u64 = 1000;
    const REWARD_THRESHOLD: Option<f64> = Some(3800.0);
    const CAMERA: CameraConfig = CameraConfig {
        trackbodyid: Some(2),
        distance: Some(3.0),
        lookat: Some([0.0, 0.0, 1.15]),
        elevation: Some(-20.0),
    };

    fn build(b: &mut Builder) -> Result<Self> {
        if b.sim().map_or(false, |sim| sim.qpos().len() < 3) {
            return Err("the model has less than 3 positions".into());
        }
        let this = Self {
            forward_reward_weight: b.real("forward_reward_weight", 1.0, "weight of the velocity along x"),
            ctrl_cost_weight: b.real("ctrl_cost_weight", 1e-3, "weight of the squared action"),
            healthy_reward: b.real("healthy_reward", 1.0, "reward for each step while healthy"),
            survive_type: match b.is_integer("healthy_reward") {
                true => Dtype::NativeInt,
                false => Dtype::NativeFloat,
            },
            terminate_when_unhealthy: b.flag("terminate_when_unhealthy", true, "terminate the episode when unhealthy"),
            state_range: b.reals(
                "healthy_state_range",
                [-100.0, 100.0],
                "open bounds of the state except x and z while healthy",
            ),
            z_range: b.reals("healthy_z_range", [0.7, f64::INFINITY], "open bounds of the height while healthy, m"),
            angle_range: b.reals("healthy_angle_range", [-0.2, 0.2], "open bounds of the pitch while healthy, rad"),
            noise: b.noise(5e-3),
            skipped: b.flag("exclude_current_positions_from_observation", true, "do not observe x").into(),
            x_before: b.carry(),
        };
        b.observation_structure(Some(this.skipped));
        Ok(this)
    }

    fn reset(&self, start: &mut Start, rng: &mut Rng) -> Result {
        for value in start.qpos.iter_mut().chain(start.qvel.iter_mut()) {
            *value += rng.uniform(-self.noise, self.noise);
        }
        Ok(())
    }

    fn reset_info(&self, sim: &Sim, info: &mut Fields) -> Result {
        info.put("x_position", sim.qpos()[0]);
        info.put("z_distance_from_origin", sim.qpos()[1] - sim.qpos0()[1]);
        Ok(())
    }

    fn carry(&self, sim: &Sim, carried: &mut Carried) -> Result {
        carried.set(self.x_before, [sim.qpos()[0]]);
        Ok(())
    }

    fn observe(&self, sim: &Sim, observation: &mut Fields) -> Result {
        observation.put_all("qpos", &sim.qpos()[self.skipped..]);
        observation.put_all("qvel", sim.qvel().iter().map(|&v| clip(v, -10.0, 10.0)));
        Ok(())
    }

    fn step(&self, sim: &Sim, row: &mut Row, info: &mut Fields) -> Result<Outcome> {
        let (x, z, angle) = (sim.qpos()[0], sim.qpos()[1], sim.qpos()[2]);
        let [x_before] = row.carried.get(self.x_before);
        let velocity = (x - x_before) / sim.dt();
        let healthy = sim.qpos()[2..].iter().chain(sim.qvel()).all(|&value| within(value, self.state_range))
            && within(z, self.z_range)
            && within(angle, self.angle_range);

        let forward = self.forward_reward_weight * velocity;
        let survive = if healthy { self.healthy_reward } else { 0.0 };
        let ctrl = self.ctrl_cost_weight * sim.action().sum_square();

        info.put("x_position", x);
        info.put("z_distance_from_origin", z - sim.qpos0()[1]);
        info.put("x_velocity", velocity);
        info.put("reward_forward", forward);
        info.put("reward_ctrl", -ctrl);
        info.put("reward_survive", survive).dtype(self.survive_type);
        Ok(Outcome {
            reward: (forward + survive) - f64::from(ctrl),
            terminated: self.terminate_when_unhealthy && !healthy,
        })
    }
}
