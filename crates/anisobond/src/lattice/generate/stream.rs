//! A stream of random numbers that is the same on every machine and in every release.

/// xoshiro256++ (Blackman and Vigna 2021), its state filled by splitmix64.
pub(in crate::lattice) struct Stream([u64; 4]);

impl Stream {
    pub fn new(seed: u64) -> Self {
        let mut state = seed;
        Stream(std::array::from_fn(|_| {
            state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (state ^ (state >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ (z >> 31)
        }))
    }

    fn bits(&mut self) -> u64 {
        let s = &mut self.0;
        let result = s[0].wrapping_add(s[3]).rotate_left(23).wrapping_add(s[0]);
        let t = s[1] << 17;
        s[2] ^= s[0];
        s[3] ^= s[1];
        s[1] ^= s[2];
        s[0] ^= s[3];
        s[2] ^= t;
        s[3] = s[3].rotate_left(45);
        result
    }

    /// Uniform in 0 ≤ x < 1.
    pub fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Uniform in −1 ≤ x < 1.
    pub fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    /// Normal with mean 0 and deviation 1, by Marsaglia's polar method.
    pub fn normal(&mut self) -> f64 {
        loop {
            let (x, y) = (self.signed(), self.signed());
            let s = x * x + y * y;
            if s > 0.0 && s < 1.0 {
                return x * (-2.0 * s.ln() / s).sqrt();
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Moments of the uniform and the normal distribution.
    #[test]
    fn moments() {
        let mut stream = Stream::new(1);
        let n = 200_000;
        let mean = |f: &mut dyn FnMut() -> f64| (0..n).map(|_| f()).sum::<f64>() / f64::from(n);
        assert!((mean(&mut || stream.unit()) - 0.5).abs() < 3e-3);
        assert!((mean(&mut || stream.unit().powi(2)) - 1.0 / 3.0).abs() < 3e-3);
        assert!(mean(&mut || stream.normal()).abs() < 1e-2);
        assert!((mean(&mut || stream.normal().powi(2)) - 1.0).abs() < 2e-2);
        assert!((mean(&mut || stream.normal().powi(4)) - 3.0).abs() < 0.1);
    }

    /// The published first outputs of xoshiro256++ for the state 1, 2, 3, 4.
    #[test]
    fn the_stream_is_the_published_one() {
        let mut stream = Stream([1, 2, 3, 4]);
        assert_eq!([stream.bits(), stream.bits(), stream.bits()], [41_943_041, 58_720_359, 3_588_806_011_781_223]);
    }
}
