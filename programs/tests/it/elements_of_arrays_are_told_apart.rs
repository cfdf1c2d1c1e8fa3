//! Elements of an array of RAPID have tools of their own, and what happens to one at run time is told of that one.

use calibench::compensate::Compensator;
use calibench_programs::{Dialect, Permissions, RewrittenProgram};

use crate::a_program_is_rewritten_and_nothing_else::{Bench, angles};
use crate::programs_are_as_controllers_write_them::{BARE, rewrite};

/// Two tools.
const TOOLS: &str = "PERS tooldata near:=[TRUE,[[0,0,0],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n\
                     PERS tooldata far:=[TRUE,[[10,0,20],[1,0,0,0]],[1,[0,0,1],[1,0,0,0],0,0,0]];\n";

/// Robtargets that the arm reaches with either tool.
fn targets(bench: &Bench) -> Vec<String> {
    let postures = [[0.3, -1.4, 1.6, 0.2, 0.7, 0.4], [0.5, -1.3, 1.5, 0.3, 0.8, 0.2], [0.2, -1.2, 1.4, 0.3, 0.9, 0.1]];
    let target = |q: &[f64; 6]| {
        let pose = Compensator::new(&bench.calibration, &BARE).unwrap().nominal_pose(q);
        let ([x, y, z], _) = angles(&pose);
        let v = nalgebra::UnitQuaternion::from_rotation_matrix(&pose.rotation);
        let nine = "9E9,9E9,9E9,9E9,9E9,9E9";
        format!("[[{x:.3},{y:.3},{z:.3}],[{:.8},{:.8},{:.8},{:.8}],[0,0,0,0],[{nine}]]", v.w, v.i, v.j, v.k)
    };
    postures.iter().map(target).collect()
}

fn rewritten(bench: &Bench, program: &str) -> RewrittenProgram {
    rewrite(bench, Dialect::Rapid, &[("m.mod", program.as_bytes().to_vec())], &Permissions::default()).remove(0)
}

/// Where the arm is told to go in place of the named positions.
fn shifts(of: &RewrittenProgram, names: &[&str]) -> Vec<[f64; 3]> {
    let shift = |name: &&str| {
        let found = of.rewritten.iter().find(|r| r.name == *name);
        found.unwrap_or_else(|| panic!("{name}: {:#?}", of.remarks)).shift().unwrap()
    };
    names.iter().map(shift).collect()
}

#[test]
fn an_element_is_compensated_in_the_tool_of_its_own_motion() {
    let bench = Bench::kr6();
    let [a, b, c] = &targets(&bench)[..] else { unreachable!() };
    let array = rewritten(
        &bench,
        &format!(
            "{TOOLS}CONST robtarget p{{3}}:=[{a},{b},{c}];\nMoveL p{{1}},v1,z1,near;\nMoveL p{{ 2 }},v1,z1,far;\nMoveL p{{3}},v1,z1,near;\n"
        ),
    );
    let alone = rewritten(
        &bench,
        &format!(
            "{TOOLS}CONST robtarget a:={a};\nCONST robtarget b:={b};\nCONST robtarget c:={c};\nMoveL a,v1,z1,near;\nMoveL b,v1,z1,far;\nMoveL c,v1,z1,near;\n"
        ),
    );
    assert!(array.is_whole() && alone.is_whole(), "{:#?} {:#?}", array.remarks, alone.remarks);
    assert_eq!(shifts(&array, &["P{1}", "P{2}", "P{3}"]), shifts(&alone, &["A", "B", "C"]));
    // Which one a variable index means is not known: all of them go with both tools.
    let both = rewritten(
        &bench,
        &format!("{TOOLS}CONST robtarget p{{2}}:=[{a},{b}];\nMoveL p{{i}},v1,z1,near;\nMoveL p{{2}},v1,z1,far;\n"),
    );
    assert!(!both.is_whole() && both.rewritten.iter().all(|r| r.name == "P{1}"), "{:#?}", both.remarks);
    // Of two dimensions.
    let table = rewritten(
        &bench,
        &format!("{TOOLS}CONST robtarget p{{2,1}}:=[[{a}],[{b}]];\nMoveL p{{1, 1}},v1,z1,near;\nMoveL p{{2,1}},v1,z1,far;\n"),
    );
    assert_eq!(shifts(&table, &["P{1,1}", "P{2,1}"]), shifts(&alone, &["A", "B"]));
}

#[test]
fn one_element_that_is_set_at_run_time_is_the_one_left() {
    let bench = Bench::kr6();
    let [a, b, c] = &targets(&bench)[..] else { unreachable!() };
    let of = |set: &str| {
        let program = format!(
            "{TOOLS}VAR robtarget p{{3}}:=[{a},{b},{c}];\n{set}\nMoveL p{{1}},v1,z1,near;\nMoveL p{{2}},v1,z1,near;\nMoveL p{{3}},v1,z1,near;\n"
        );
        rewritten(&bench, &program)
    };
    let names = |new: &RewrittenProgram| new.rewritten.iter().map(|r| r.name.clone()).collect::<Vec<_>>();
    let one = of("p{2}.trans.x:=430;");
    assert_eq!((names(&one), one.positions), (vec!["P{1}".to_owned(), "P{3}".into()], 3), "{:#?}", one.remarks);
    assert!(one.remarks.iter().any(|r| r.line == 4 && r.what == "p{2}.trans.x"), "{:#?}", one.remarks);
    // Of any, of all.
    let any = of("p{i}.trans.x:=430;");
    assert!(names(&any).is_empty() && any.positions == 3, "{:#?}", any.remarks);
    // A copy of one is told of the one that it replaces.
    let copied = of("p{2}:=p{3};");
    assert!(copied.remarks.iter().any(|r| r.line == 4 && r.what == "p{2}"), "{:#?}", copied.remarks);
    assert_eq!(names(&copied).len(), 3, "{:#?}", copied.remarks);
}

/// The arm stays where external axes move alone: the joints written beside them are no positions.
#[test]
fn a_motion_of_external_axes_has_no_position_of_the_arm() {
    let bench = Bench::kr6();
    let a = &targets(&bench)[0];
    let program = format!(
        "{TOOLS}CONST jointtarget turn:=[[0,0,0,0,0,0],[90,9E9,9E9,9E9,9E9,9E9]];\nMoveExtJ turn,vrot10,fine;\n\
         MoveExtJ [[0,0,0,0,0,0],[0,9E9,9E9,9E9,9E9,9E9]],vrot10,fine;\nMoveL {a},v1,z1,near;\n"
    );
    let new = rewritten(&bench, &program);
    assert!(new.is_whole() && new.rewritten.len() == 1, "{:#?}", new.remarks);
    assert_eq!(new.bytes.iter().filter(|b| **b == b';').count(), program.matches(';').count());
    assert!(String::from_utf8_lossy(&new.bytes).contains("turn:=[[0,0,0,0,0,0],[90,9E9"), "its joints stay");
}
