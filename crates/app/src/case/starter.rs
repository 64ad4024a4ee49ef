//! The case file that `anisobond new case` writes.

/// A commented case that runs as it is: a tensile bar with a notch, to be changed.
pub fn starter_case(name: &str) -> String {
    let name = name.replace(['"', '\\', '\n', '\r'], "");
    STARTER.replace("NAME", &name)
}

const STARTER: &str = r#"# A bar of glass with an edge crack, pulled apart.
#
#   anisobond check NAME.toml       what it would take
#   anisobond run NAME.toml         run it
#
# Quantities carry their units. Every key is described in docs/cases.md.
name = "NAME"
description = "edge-cracked bar under tension"

# What it is made of: a built-in name (anisobond materials), a material file, or its keys here.
material = { class = "isotropic", unit = "GPa", engineering = { e = 72, nu = 0.25 }, density = "2440 kg/m3" }
fracture = { energy = "3.8 J/m2" }       # leave it out: bonds never break

# The body: box, cylinder, sphere, halfspace, stl; union, difference, intersection of them.
[body]
box = { size = "40, 20 mm" }             # two lengths: infinite along z, cut by plane_strain below

[grid]
spacing = "0.5 mm"
horizon = 3                              # in spacings
plane_strain = "z"                       # one periodic layer
# periodic = ["x"]

[model]
bonds = "central"                        # or "hybrid": reaches every positive definite stiffness
kinematics = "linear"                    # or "finite": finite stretch
surface_calibration = true               # truncated neighbourhoods are calibrated, too

# Whatever is not here is free.
[[condition]]
name = "top"
on = "y-max"                             # x-min … z-max, a solid, a region, "all"
traction = ["0 MPa", "4 MPa", "0 MPa"]
history = { ramp = ["0 us", "5 us"] }

[[condition]]
name = "bottom"
on = "y-min"
traction = ["0 MPa", "-4 MPa", "0 MPa"]
history = { ramp = ["0 us", "5 us"] }

# No bond passes through a crack.
[[crack]]
line = { from = "-20, 0 mm", to = "-10, 0 mm" }

[motion]                                 # or [equilibrium] with steps = 10
duration = "40 us"

[[probe]]
name = "opening"
quantity = "displacement"
at = "-20, 5, 0 mm"

[output]
fields = ["displacement", "damage"]
frames = 20
slices = [{ axis = "z", field = "damage" }]
probe_every = 10
"#;
