//! Circles, subprograms, jumps, labels and loops: each position is taken in the tool and base that are switched on where the
//! program moves to it, and read back by arithmetic of this test alone.

use std::fs;

use calibench::robot::inverse::StatusTurn;
use calibench_programs::{Dialect, NamedFrames, Permissions, RewrittenProgram, read_frames};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use crate::a_program_is_rewritten_and_nothing_else::{Bench, Writer, angles, of_angles};
use crate::programs_are_as_controllers_write_them::{
    BASES, Made, POSITIONS, PROGRAMS, Random, TOOLS, krl_numbers, line, rewrite, told,
};

/// The frames of the generator by their numbers, as a list of one's own.
pub fn listed() -> NamedFrames {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("frames.toml");
    let list = |frames: &[[f64; 6]]| (1..frames.len()).map(|k| format!("{k} = {:?}\n", frames[k])).collect::<String>();
    let text = format!("format = \"calibench-frames/1\"\n[tools]\n{}[bases]\n{}", list(&TOOLS), list(&BASES));
    fs::write(&path, text).unwrap();
    read_frames(&path).unwrap()
}

/// A program in the making, with its positions and the lines that are told.
pub struct Making {
    pub w: Writer,
    pub made: Vec<Made>,
    pub warned: Vec<usize>,
}

impl Making {
    pub fn new(head: String) -> Self {
        let mut w = Writer::new();
        w.fixed(head);
        Making { w, made: Vec::new(), warned: Vec::new() }
    }

    pub fn holds(&self, bench: &Bench, new: &RewrittenProgram, numbers: usize, first: usize, w_p_r: bool) {
        told(new, &self.warned);
        let (old, found) = (self.w.old_numbers(), self.w.numbers_of(&new.bytes));
        assert_eq!(old.len(), numbers * self.made.len());
        let pose = |n: &[f64]| {
            let n = &n[first..];
            let abc = if w_p_r { [n[5], n[4], n[3]] } else { [n[3], n[4], n[5]] };
            of_angles([n[0], n[1], n[2]], abc)
        };
        for (k, made) in self.made.iter().enumerate() {
            made.holds(bench, pose(&old[numbers * k..]), pose(&found[numbers * k..]));
        }
    }
}

/// The positions of a FANUC program: W, P, R, the turn numbers before them.
fn fanuc_positions(making: &mut Making, bench: &Bench, switched: &[bool]) {
    let w = &mut making.w;
    w.fixed("/POS\n");
    for (k, made) in making.made.iter().enumerate() {
        let StatusTurn { status, .. } = StatusTurn::of(&bench.wrist(), made.q[..].try_into().unwrap());
        let letters = [if status & 4 == 0 { 'N' } else { 'F' }, if status & 2 != 0 { 'U' } else { 'D' }];
        let frames = if switched[k] { "UF : F, UT : F".into() } else { format!("UF : {}, UT : {}", made.base, made.tool) };
        w.fixed(format!(
            "P[{}{}]{{\n   GP1:\n\t{frames},\t\tCONFIG : '{} {} T, ",
            k + 1,
            [":\"way\"", ""][k % 2],
            letters[0],
            letters[1]
        ));
        (0..3).for_each(|k| _ = w.fixed(["", ", ", ", "][k]).number(0.0, 0));
        let (xyz, [a, b, c]) = angles(&made.pose(bench));
        w.fixed("',\n");
        for (k, (name, value)) in "XYZWPR".chars().zip(xyz.into_iter().chain([c, b, a])).enumerate() {
            w.fixed(format!("{}\t{name} =  ", ["", ","][usize::from(k > 0)])).number(value, 4);
            w.fixed(if k < 3 { "  mm" } else { " deg" });
        }
        w.fixed("\n};\n");
    }
    w.fixed("/END\n");
}

#[test]
fn fanuc_of_the_pendant() {
    let bench = Bench::other();
    let wrist = bench.wrist();
    // Letters of an arm that reaches backward leave two elbows; and turn numbers may change near half a turn.
    let is_plain = |q: &[f64]| StatusTurn::of(&wrist, q.try_into().unwrap()).status & 1 == 0 && q.iter().all(|q| q.abs() < 3.0);
    for seed in 0..PROGRAMS {
        let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
        let plain = |random: &mut Random| loop {
            let made = random.made(&bench);
            if is_plain(&made.q) {
                return made;
            }
        };
        let mut main = Making::new("/PROG  MAIN\n/ATTR\nCOMMENT\t= \"x\";\n/MN\n".into());
        let (mut switched, mut subs) = (Vec::new(), Vec::new());
        let mut number = 0;
        let put = |main: &mut Making, number: &mut usize, text: String| {
            *number += 1;
            main.w.fixed(format!("{:4}:{text} ;\n", *number));
        };
        for k in 0..POSITIONS {
            let made = plain(&mut random);
            let Made { tool, base, .. } = made;
            put(&mut main, &mut number, format!("  UFRAME_NUM={base}"));
            put(&mut main, &mut number, format!("  UTOOL_NUM[GP1]={tool}"));
            let is_switched = random.below(2) == 0;
            let p = format!("P[{}]", main.made.len() + 1);
            match random.below(8) {
                0 => put(&mut main, &mut number, format!("J {p} 100% FINE ACC80")),
                1 => {
                    main.warned.push(line(&main.w));
                    let offset = ["Offset,PR[3]", "Tool_Offset,PR[3:shift]", "Offset"][random.below(3)];
                    put(&mut main, &mut number, format!("L {p} 100mm/sec CNT50 {offset}"));
                }
                2 => {
                    let end = main.made.len() + 2;
                    put(&mut main, &mut number, format!("C {p}    \n    :  P[{end}] 200mm/sec CNT100"));
                    let q = plain(&mut random).q;
                    main.made.push(Made { q, tool, base });
                    switched.push(is_switched);
                }
                3 => {
                    let mut sub =
                        Making::new(format!("/PROG SUB{k}\tProcess\n/MN\n   1:  !P[7] ;\n   2:L P[1:go] R[1]mm/sec FINE ;\n"));
                    sub.made.push(made);
                    fanuc_positions(&mut sub, &bench, &[true]);
                    subs.push(sub);
                    put(&mut main, &mut number, format!("  {}CALL SUB{k}(1,R[2])", ["", "IF DI[1]=ON,"][random.below(2)]));
                    continue;
                }
                4 => {
                    put(&mut main, &mut number, "  IF (DI[1]=ON AND !DI[2]) THEN".into());
                    put(&mut main, &mut number, format!("  UFRAME_NUM={base}"));
                    put(&mut main, &mut number, "  ELSE".into());
                    put(&mut main, &mut number, format!("  UFRAME_NUM=({base})"));
                    put(&mut main, &mut number, "  ENDIF".into());
                    put(&mut main, &mut number, "  FOR R[1]=1 TO 3".into());
                    put(&mut main, &mut number, format!("L {p} 100mm/sec FINE"));
                    put(&mut main, &mut number, "  ENDFOR".into());
                }
                5 => {
                    put(&mut main, &mut number, format!("  LBL[{}:again]", k + 1));
                    put(&mut main, &mut number, format!("L {p} 100mm/sec CNT100 Skip,LBL[{}]", k + 1));
                    put(&mut main, &mut number, format!("  IF R[1]<3,JMP LBL[{}]", k + 1));
                }
                6 => {
                    put(&mut main, &mut number, format!("  JMP LBL[{}]", 100 + k));
                    put(&mut main, &mut number, "  UFRAME_NUM=9".into());
                    put(&mut main, &mut number, format!("  LBL[{}]", 100 + k));
                    put(&mut main, &mut number, format!("A {p} 100mm/sec CNT100"));
                }
                _ => {
                    for text in ["L PR[5] 100mm/sec FINE", "  PR[5,3]=R[2]", "J P[R[1]] 50% FINE"] {
                        main.warned.push(line(&main.w));
                        put(&mut main, &mut number, text.into());
                    }
                    continue;
                }
            }
            main.made.push(made);
            switched.push(is_switched);
            // Circles have their second position last.
            let last = main.made.len() - 1;
            if last > 0 && main.made[last - 1].tool == tool && main.made[last - 1].base == base {
                switched[last] = switched[last - 1];
            }
        }
        fanuc_positions(&mut main, &bench, &switched);
        let permissions = Permissions { frames: listed(), ..Permissions::default() };
        let names: Vec<String> = (0..=subs.len()).map(|k| format!("{k}.ls")).collect();
        let all: Vec<&Making> = [&main].into_iter().chain(&subs).collect();
        let files: Vec<(&str, Vec<u8>)> = names.iter().zip(&all).map(|(name, one)| (name.as_str(), one.w.bytes())).collect();
        let new = rewrite(&bench, Dialect::Fanuc, &files, &permissions);
        for (making, new) in all.iter().zip(&new) {
            making.holds(&bench, new, 9, 3, true);
        }
        let bare = rewrite(&bench, Dialect::Fanuc, &files, &Permissions::default());
        assert!(bare.iter().all(|new| new.rewritten.is_empty()) && bare.iter().any(|new| !new.is_whole()));
    }
}

#[test]
fn krl_circles_calls_and_jumps() {
    let bench = Bench::kr6();
    for seed in 0..PROGRAMS {
        let mut random = Random(ChaCha8Rng::seed_from_u64(seed));
        let mut main = Making::new("&ACCESS RVP\r\nDEF main()\r\n".into());
        let mut subs = Writer::new();
        let mut in_subs = Vec::new();
        for k in 0..POSITIONS {
            let made = random.made(&bench);
            let Made { tool, base, .. } = made;
            let other = Made { q: random.made(&bench).q, tool, base };
            main.w.fixed(format!("$TOOL=TOOL_DATA[{tool}]\r\n$BASE=BASE_DATA[{base}]\r\n"));
            let numbers = |w: &mut Writer, made: &Made| {
                w.fixed("{");
                krl_numbers(w, &bench, made);
                w.fixed("}");
            };
            match random.below(4) {
                0 => {
                    main.w.fixed(["CIRC ", "SCIRC "][random.below(2)]);
                    numbers(&mut main.w, &made);
                    main.w.fixed(", ");
                    numbers(&mut main.w, &other);
                    main.w.fixed(", CA 180.0 C_DIS\r\n");
                    main.made.push(made);
                    main.made.push(other);
                }
                1 => {
                    main.w.fixed(format!("Sub{k} (2)\r\n"));
                    subs.fixed(format!("{}DEF Sub{k}(n:IN)\r\nINT n\r\nLIN ", ["", "GLOBAL "][random.below(2)]));
                    numbers(&mut subs, &made);
                    subs.fixed(" C_DIS\r\nEND\r\n");
                    in_subs.push(made);
                }
                2 => {
                    // What stands behind the jump is never reached.
                    main.w.fixed(format!("GOTO L{k}\r\n$BASE=BASE_DATA[9]\r\nL{k}:\r\nFOR i=1 TO 3\r\nPTP "));
                    numbers(&mut main.w, &made);
                    main.w.fixed("\r\nENDFOR\r\n");
                    main.made.push(made);
                }
                _ => {
                    main.w.fixed("REPEAT\r\nSWITCH n\r\nCASE 1\r\nLIN ");
                    numbers(&mut main.w, &made);
                    main.w.fixed("\r\nDEFAULT\r\nLIN ");
                    numbers(&mut main.w, &other);
                    main.w.fixed("\r\nENDSWITCH\r\nUNTIL $IN[1]\r\n");
                    main.made.push(made);
                    main.made.push(other);
                }
            }
        }
        main.w.fixed("END\r\n");
        let permissions = Permissions { frames: listed(), ..Permissions::default() };
        let sub = Making { w: subs, made: in_subs, warned: Vec::new() };
        let files = [("main.src", main.w.bytes()), ("subs.src", sub.w.bytes())];
        let new = rewrite(&bench, Dialect::Krl, &files, &permissions);
        main.holds(&bench, &new[0], 8, 0, false);
        sub.holds(&bench, &new[1], 8, 0, false);
    }
}
