//! `anisobond materials`.

use anisobond::Result;
use anisobond::tensor::Material;
use serde_json::json;

use crate::{Ending, args, text};

pub fn run(args: &args::Materials) -> Result<Ending> {
    let materials = Material::builtin_names().into_iter().filter_map(Material::builtin);
    let class = |m: &Material| Material::builtin_class(&m.name).map_or("", |c| c.name());
    if args.json {
        let all: Vec<_> = materials
            .map(|m| json!({"material": m.name, "class": class(&m), "source": m.source, "stiffness": m.stiffness.voigt_rows()}))
            .collect();
        return text::print_json(&json!({ "materials": all })).map(|()| Ending::Done);
    }
    let lines: String = materials.map(|m| format!("{:10} {:24} {}\n", m.name, class(&m), m.source)).collect();
    text::print(&lines).map(|()| Ending::Done)
}
