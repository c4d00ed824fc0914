//! Compares norms with those of NumPy, which random.txt in tests/golden has.

use std::fs;

use mjenv::numpy::Norm;

use crate::golden::{folder, real};

#[test]
fn norms_of_any_length_are_those_of_numpy() {
    let text = fs::read_to_string(folder().join("random.txt")).unwrap();
    let (mut few, mut many, mut unlike) = (0, 0, 0);
    for line in text.lines().filter_map(|line| line.strip_prefix("norm ")) {
        let words: Vec<_> = line.split(' ').collect();
        let fused = words[0] == "fused";
        let numbers: Vec<_> = if words[1] == "first" {
            many += 1;
            let term = |i: u64| ((7919 * i + 13) % 1009) as f64 / 17.0 - 30.0;
            (0..words[2].parse().unwrap()).map(term).collect()
        } else {
            few += 1;
            words[1..words.len() - 1].iter().map(|word| real(word)).collect()
        };
        let expected = real(words[words.len() - 1]);
        assert_eq!(
            Norm::new(fused).of(&numbers).to_bits(),
            expected.to_bits(),
            "{} numbers, {}",
            numbers.len(),
            words[0]
        );
        unlike += usize::from(Norm::new(!fused).of(&numbers).to_bits() != expected.to_bits());
    }
    assert_eq!((few, many), (400, 2 * 205));
    assert!(unlike > 20);
}

#[test]
fn a_norm_takes_arrays_slices_and_vectors() {
    let norm = Norm::new(false);
    assert_eq!(
        (norm.of([3.0, 4.0]), norm.of(&[3.0, 4.0][..]), norm.of(vec![3.0, 4.0]), norm.of([])),
        (5.0, 5.0, 5.0, 0.0)
    );
}
