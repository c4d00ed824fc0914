//! Compares batches with recordings of Gymnasium's SyncVectorEnv in its three modes of automatic resets.

use mjenv::{Batch, Env};

use crate::golden::{assert_bits, Actions, Golden, Info, Table};

const ROWS: usize = 3;

/// The infos that SyncVectorEnv returned. A row has a key only if its mask says so.
struct Infos<'a> {
    fields: &'a [Info],
    values: Table,
    masks: Vec<bool>,
}

impl<'a> Infos<'a> {
    fn new(golden: &Golden, name: &str, fields: &'a [Info]) -> Self {
        Self { fields, values: golden.table(name), masks: golden.flags(&format!("{name}_mask")) }
    }

    /// `got` returns the numbers of all rows for a key, or `None` if this row does not have the key.
    fn check<'b>(&self, place: &str, line: usize, row: usize, got: impl Fn(&str) -> Option<&'b [f64]>) {
        let width: usize = self.fields.iter().map(|field| field.count).sum();
        let mut offset = row * width;
        for (index, field) in self.fields.iter().enumerate() {
            let got = got(&field.name);
            assert_eq!(got.is_some(), self.masks[(line * ROWS + row) * self.fields.len() + index], "{place}");
            if let Some(values) = got {
                let expected = &self.values.row(line)[offset..][..field.count];
                assert_bits(&format!("{place} {}", field.name), &values[row * field.count..][..field.count], expected);
            }
            offset += field.count;
        }
    }
}

struct Replay<'a> {
    golden: &'a Golden,
    env: Env,
    batch: Batch,
    actions: Vec<f32>,
}

impl<'a> Replay<'a> {
    fn new(golden: &'a Golden) -> Self {
        let mut options = golden.options();
        options.set("num_threads", 2).unwrap();
        let env = Env::new(&options, ROWS).unwrap();
        let actions = match golden.actions() {
            Actions::Float32(actions) => actions,
            Actions::Float64(_) => panic!("{} has float64 actions", golden.file),
        };
        Self { batch: env.batch::<f64>(), env, golden, actions }
    }

    fn reset(&mut self, reset: usize) {
        let mask = &self.golden.flags("reset_mask")[reset * ROWS..][..ROWS];
        let seeds = &self.golden.integers("reset_seed")[reset * ROWS..][..ROWS];
        let seeded: Vec<_> = seeds.iter().map(|&seed| seed >= 0).collect();
        let seeds: Vec<_> = seeds.iter().map(|&seed| seed as u64).collect();
        self.env.seed(&seeded, &seeds).unwrap();
        self.env.reset(mask, &mut self.batch).unwrap();
        let infos = Infos::new(self.golden, "reset_reset_info", &self.golden.reset_info);
        for row in (0..ROWS).filter(|&row| mask[row]) {
            let place = format!("{} reset {reset} row {row}", self.golden.file);
            self.check("reset_obs", &place, reset, row, self.batch.obs(row));
            infos.check(&place, reset, row, |name| self.batch.reset_info(name).ok());
        }
    }

    fn check(&self, name: &str, place: &str, line: usize, row: usize, got: &[f64]) {
        let table = self.golden.table(name);
        let width = table.row(line).len() / ROWS;
        assert_bits(&format!("{place} {name}"), got, &table.row(line)[row * width..][..width]);
    }

    fn step(&mut self, step: usize) {
        let count = ROWS * self.env.action_space().count();
        self.env.step(.., &self.actions[step * count..][..count], &mut self.batch).unwrap();
        let batch = &self.batch;
        let flags = |name: &str| self.golden.flags(name)[step * ROWS..][..ROWS].to_vec();
        assert_eq!(batch.terminated(), flags("terminated"));
        assert_eq!(batch.truncated(), flags("truncated"));
        for row in 0..ROWS {
            let place = format!("{} step {step} row {row}", self.golden.file);
            self.check("obs", &place, step, row, batch.obs(row));
            self.check("reward", &place, step, row, &batch.reward()[row..=row]);
            let told = |name: &str| {
                let found = if batch.was_reset()[row] { batch.reset_info(name) } else { batch.info(name) };
                found.ok()
            };
            for (name, fields) in [("info", &self.golden.info), ("reset_info", &self.golden.reset_info)] {
                Infos::new(self.golden, name, fields).check(&place, step, row, told);
            }
            assert_eq!(batch.final_obs(row).is_some(), flags("final_obs_mask")[row], "{place}");
            if let Some(obs) = batch.final_obs(row) {
                self.check("final_obs", &place, step, row, obs);
            }
            let last = batch.final_obs(row).map(|_| batch);
            Infos::new(self.golden, "final_info", &self.golden.info)
                .check(&place, step, row, |name| last.map(|batch| batch.final_info(name).unwrap()));
        }
    }
}

#[test]
fn the_three_modes_are_gymnasiums() {
    for golden in Golden::all("vector", "") {
        let mut replay = Replay::new(&golden);
        let resets = golden.reset_at();
        let steps = golden.flags("terminated").len() / ROWS;
        for step in 0..steps {
            if let Some(reset) = resets.iter().position(|&at| at == step) {
                replay.reset(reset);
            }
            replay.step(step);
        }
    }
}
