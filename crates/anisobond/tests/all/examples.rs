//! The examples run.

#[path = "../../examples/calibrate.rs"]
mod calibrate;
#[path = "../../examples/element_test.rs"]
mod element_test;
#[path = "../../examples/run.rs"]
mod run;

#[test]
fn examples_run() {
    calibrate::main().unwrap();
    element_test::main().unwrap();
    run::main().unwrap();
}
