//! Tools and bases however a program states them: taken with the positions that have them, or told with the positions left as
//! they are.

use calibench_programs::{Dialect, Permissions, RewrittenProgram};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::a_program_is_rewritten_and_nothing_else::Bench;
use crate::every_dialect_branches_and_calls::{Making, listed};
use crate::programs_are_as_controllers_write_them::{Made, Random, krl_numbers, rewrite};

/// Permissions with the tools and the bases of the generator by their numbers.
pub fn with_frames() -> Permissions {
    Permissions { frames: listed(), ..Permissions::default() }
}

/// A posture in this tool and this base.
pub fn made(bench: &Bench, seed: u64, [tool, base]: [usize; 2]) -> Made {
    let q = Random(ChaCha8Rng::seed_from_u64(seed)).made(bench).q;
    Made { q, tool, base }
}

/// Puts a position of KRL into a program.
pub fn krl_position(making: &mut Making, bench: &Bench, made: Made) {
    making.w.fixed("{");
    krl_numbers(&mut making.w, bench, &made);
    making.w.fixed("}\n");
    making.made.push(made);
}

/// Asserts that a program stays as it is, and that of each of these lines something is told, blocking or not.
pub fn left(old: &[u8], new: &RewrittenProgram, lines: &[(usize, &str, bool)]) {
    assert_eq!(new.bytes, old, "every byte stays");
    for (line, what, blocks) in lines {
        let is_this = |r: &&calibench_programs::Remark| r.line == *line && r.what.contains(what) && r.blocks == *blocks;
        assert!(new.remarks.iter().any(|r| is_this(&r)), "{line}: {what}: {:#?}", new.remarks);
    }
}

#[test]
fn bas_with_a_variable_is_an_unknown_frame_and_an_external_base_moves() {
    let bench = Bench::kr6();
    let of = |lines: &str, at: [usize; 2]| {
        let mut making = Making::new(format!("DEF a()\nDECL INT n\nn=2\n{lines}LIN "));
        krl_position(&mut making, &bench, made(&bench, 1, at));
        making.w.fixed("END\n");
        let new = rewrite(&bench, Dialect::Krl, &[("a.src", making.w.bytes())], &with_frames()).remove(0);
        (making, new)
    };
    for (lines, line, what) in [
        ("BAS(#TOOL,n)\nBAS(#BASE,1)\n", 6, "TOOL_DATA[N]"),
        ("BAS (#TOOL, 1)\nBAS(#BASE,n)\n", 6, "BASE_DATA[N]"),
        ("BAS(#TOOL,1)\nBAS(#EX_BASE,1)\n", 6, "#EX_BASE"),
    ] {
        let (making, new) = of(lines, [1, 1]);
        left(&making.w.bytes(), &new, &[(line, what, true)]);
    }
    let (making, new) = of("BAS(#TOOL,2)\nBAS(#EX_BASE,1)\nBAS(#BASE,1)\n", [2, 1]);
    making.holds(&bench, &new, 8, 0, false);
}
