//! What a verification suite says of one printed value.

use serde::Serialize;

/// How our value, the printed one and the corrected reference relate.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Ours is the reference, and the document prints it.
    Agrees,
    /// Ours is the reference; the document prints nothing to compare.
    Unprinted,
    /// Ours is the reference; the printed value is wrong, and the note says why.
    PublishedWrong,
    /// Ours is not the reference: a fault of this program.
    Deviates,
}

/// One value of a document, recomputed.
#[derive(Clone, Debug, Serialize)]
pub struct Finding {
    /// Where the document has it: "Table 1", "Fig 12", "eq (88)".
    pub place: &'static str,
    /// What it is, with its unit.
    pub quantity: String,
    /// As printed; empty where nothing is.
    pub published: String,
    /// The corrected value.
    pub reference: f64,
    /// Largest |ours − reference| accepted.
    pub tolerance: f64,
    /// Relative accuracy that the document itself states for this value; 0 where its printed digits are meant.
    pub stated_accuracy: f64,
    /// As computed now.
    pub ours: f64,
    /// Why the printed value is wrong; empty where it is not.
    pub note: &'static str,
}

impl Finding {
    /// How the three values relate.
    pub fn verdict(&self) -> Verdict {
        let error = (self.ours - self.reference).abs();
        if error.is_nan() || error > self.tolerance {
            return Verdict::Deviates;
        }
        if self.published.is_empty() {
            return Verdict::Unprinted;
        }
        if self.printed_to_its_digits() { Verdict::Agrees } else { Verdict::PublishedWrong }
    }

    /// Whether the printed number is ours, to half a unit of its last digit or to the accuracy that the document states.
    fn printed_to_its_digits(&self) -> bool {
        let Ok(value) = self.published.parse::<f64>() else { return false };
        let (mantissa, exponent) = self.published.split_once('e').unwrap_or((&self.published, "0"));
        let decimals = mantissa.split_once('.').map_or(0, |(_, d)| d.len() as i32);
        let last = 10f64.powi(exponent.parse::<i32>().unwrap_or(0) - decimals);
        (self.ours - value).abs() <= (0.5 * last * (1.0 + 1e-9)).max(self.stated_accuracy * value.abs())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn finding(published: &str, ours: f64) -> Verdict {
        let published = published.to_string();
        let quantity = String::new();
        Finding {
            place: "",
            quantity,
            published,
            reference: ours,
            tolerance: 0.0,
            stated_accuracy: 0.0,
            ours,
            note: "",
        }
        .verdict()
    }

    #[test]
    fn printed_digits_decide() {
        assert_eq!(finding("3.1873", 3.18727629), Verdict::Agrees);
        assert_eq!(finding("3.1874", 3.18727629), Verdict::PublishedWrong);
        assert_eq!(finding("924", 924.0), Verdict::Agrees);
        assert_eq!(finding("2.7225e-11", 0.0), Verdict::PublishedWrong);
        assert_eq!(finding("no solution", 1.0), Verdict::PublishedWrong);
        assert_eq!(finding("", 1.0), Verdict::Unprinted);
        let mut wrong = Finding {
            place: "",
            quantity: String::new(),
            published: "1".into(),
            reference: 1.0,
            tolerance: 0.1,
            stated_accuracy: 0.0,
            ours: 1.2,
            note: "",
        };
        assert_eq!(wrong.verdict(), Verdict::Deviates);
        wrong.ours = f64::NAN;
        assert_eq!(wrong.verdict(), Verdict::Deviates);
    }
}
