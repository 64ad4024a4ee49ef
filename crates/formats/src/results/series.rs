//! The list of a run's frames for ParaView (`.pvd`).

use std::fmt::Write;

/// Frames in time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Series {
    /// Time (s) or load factor (–), and file name beside the list.
    pub frames: Vec<(f64, String)>,
}

/// The text of a `.pvd` file.
pub fn pvd(series: &Series) -> String {
    let mut file = String::from(
        "<?xml version=\"1.0\"?>\n<VTKFile type=\"Collection\" version=\"1.0\" byte_order=\"LittleEndian\">\n<Collection>\n",
    );
    for (time, name) in &series.frames {
        let _ = writeln!(file, "<DataSet timestep=\"{time:?}\" file=\"{name}\"/>");
    }
    file.push_str("</Collection>\n</VTKFile>\n");
    file
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_frame_is_listed() {
        let series = Series { frames: vec![(0.0, "a-0000.vti".into()), (1.5e-6, "a-0001.vti".into())] };
        let text = pvd(&series);
        let file = roxmltree::Document::parse(&text).unwrap();
        let sets: Vec<_> = file
            .descendants()
            .filter(|n| n.has_tag_name("DataSet"))
            .map(|n| {
                (n.attribute("timestep").unwrap().parse::<f64>().unwrap(), n.attribute("file").unwrap().to_string())
            })
            .collect();
        assert_eq!(sets, series.frames);
    }
}
