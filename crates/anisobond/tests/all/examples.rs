//! The examples run.

#[path = "../../examples/bond_law.rs"]
mod bond_law;
#[path = "../../examples/calibrate.rs"]
mod calibrate;
#[path = "../../examples/element_test.rs"]
mod element_test;
#[path = "../../examples/run.rs"]
mod run;

#[test]
fn examples_run() {
    bond_law::main().unwrap();
    calibrate::main().unwrap();
    element_test::main().unwrap();
    run::main().unwrap();
}
