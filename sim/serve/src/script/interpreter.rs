//! Runs programs.

use std::rc::Rc;

use tokio::task::LocalSet;

use super::machine::{Frame, Host, Machine, Stop, Task};
use super::tree::Program;
use super::trouble::Trouble;

/// Runs a program until it ends, halts or fails. Its threads end with it, also when this future is dropped.
pub async fn run<H: Host>(program: Rc<Program>, host: Rc<H>) -> Result<(), Trouble> {
    let machine = Rc::new(Machine::new(host));
    // A set of its own: dropping it ends all the threads at once, wherever they wait.
    let threads = LocalSet::new();
    let stop = threads.run_until(until_end(&machine, &program)).await;
    drop(threads);
    match stop {
        Stop::Halt => Ok(()),
        Stop::Trouble(trouble) => Err(trouble),
    }
}

async fn until_end<H: Host>(machine: &Rc<Machine<H>>, program: &Program) -> Stop {
    let task = Task::default();
    let frame = Frame { scope: Rc::default(), function: program.name(), task: &task };
    tokio::select! {
        biased;
        stop = machine.ended() => stop,
        end = machine.body(&program.main.body, &frame) => end.err().unwrap_or(Stop::Halt),
    }
}

#[cfg(test)]
mod tests {
    use std::cell::{Cell, RefCell};
    use std::time::Duration;

    use super::super::arguments::Arguments;
    use super::super::parser::parse;
    use super::super::value::Value;
    use super::*;

    /// Writes down what programs say.
    #[derive(Default)]
    struct Listener {
        said: Rc<RefCell<Vec<String>>>,
    }

    struct Held {
        said: Rc<RefCell<Vec<String>>>,
    }

    impl Drop for Held {
        fn drop(&mut self) {
            self.said.borrow_mut().push("let go".to_owned());
        }
    }

    impl Host for Listener {
        async fn call(&self, name: &str, arguments: &Arguments) -> Result<Value, Trouble> {
            let missing = || Trouble::new(format!("{name} needs more arguments"));
            match name {
                "say" => {
                    let text = arguments.get(0, "text").ok_or_else(missing)?.to_string();
                    self.said.borrow_mut().push(text);
                    Ok(Value::None)
                }
                "wait" => {
                    tokio::time::sleep(Duration::from_millis(5)).await;
                    Ok(Value::None)
                }
                "hold" => {
                    let _held = Held { said: Rc::clone(&self.said) };
                    std::future::pending().await
                }
                "speed" => Ok(Value::Float(arguments.number(1, "v").ok_or_else(missing)?)),
                _ => Err(Trouble::new(format!("there is no function {name}"))),
            }
        }
    }

    struct Outcome {
        said: String,
        result: Result<(), Trouble>,
    }

    impl Outcome {
        fn trouble(&self) -> String {
            self.result.as_ref().map_or_else(ToString::to_string, |()| "none".to_owned())
        }
    }

    async fn outcome(text: &str) -> Outcome {
        let host = Rc::new(Listener::default());
        let result = match parse(text) {
            Ok(program) => run(Rc::new(program), Rc::clone(&host)).await,
            Err(error) => Err(Trouble::new(error.to_string())),
        };
        let said = host.said.borrow().join(" ");
        Outcome { said, result }
    }

    async fn said(text: &str) -> String {
        let outcome = outcome(text).await;
        assert_eq!(outcome.result, Ok(()));
        outcome.said
    }

    async fn value(expression: &str) -> String {
        said(&format!("say({expression})")).await
    }

    #[tokio::test]
    async fn expressions_have_values() {
        assert_eq!(value("1 + 2 * 3 - -4 % 3").await, "8");
        assert_eq!(value("to_str(7 / 2) ").await, "3.5");
        assert_eq!(value("2 < 3 and not 1 == 2 xor False").await, "True");
        assert_eq!(value("False and nothing() or true").await, "True");
        assert_eq!(value("[1, 2.0] == [1.0, 2]").await, "True");
        assert_eq!(value("p[1,2,3,0,0,0] != p[1,2,3,0,0,0]").await, "False");
        assert_eq!(value("p[1,2,3,4,5,6][3] + [[7, 8], 9][0][1]").await, "12");
        assert_eq!(said("m = [[1, 2], [3, 4]]\nm[1, 0] = 5\nsay(m[1, 0] + m[0][1])").await, "7");
        assert_eq!(value("str_cat('a', str_cat(1, \" b\"))").await, "a1 b");
        assert_eq!(value("norm([3, 4]) + length([1]) + floor(2.7) + abs(-1) + sqrt(pow(2, 2))").await, "11");
        assert_eq!(value("r2d(atan2(1, 1)) + log(2, 8) + str_len('abc') + to_num('2')").await, "53");
        assert_eq!(value("speed(0, v=0.25) * 4").await, "1");
    }

    #[tokio::test]
    async fn functions_see_the_variables_around_them() {
        let text = "def work():\n count = 1\n local list = [0, 0]\n p = p[0, 0, 0, 0, 0, 0]\n p[2] = 5\n def first():\n  \
                    count = count + 1\n  own = 7\n  later(by=10)\n end\n def later(n=2, by=1):\n  count = count + n * by\n  \
                    list[1] = count\n  global made = list[1] == 22\n end\n first()\n say(count)\n say(list)\n say(made)\n \
                    say(p[2])\n say(own)\nend\n";
        let outcome = outcome(text).await;
        assert_eq!(outcome.said, "22 [0, 22] True 5");
        assert_eq!(outcome.trouble(), "line 21, in work: there is no variable own");
    }

    #[tokio::test]
    async fn branches_and_loops_are_taken() {
        let text = "def f(n):\n if n == 0:\n  return 'zero'\n elif (n == 1):\n  return 'one'\n elif n < 0:\n  pass\n else:\n  \
                    return 'many'\n end\nend\nsay(f(0))\nsay(f(1))\nsay(f(-1))\nsay(f(5))\ni = 0\nwhile (True):\n i = i + 1\n \
                    if i == 2:\n  continue\n end\n if i > 4:\n  break\n end\n say(i)\nend\nenter_critical\nhalt\nsay('never')";
        assert_eq!(said(text).await, "zero one None many 1 3 4");
    }

    #[tokio::test]
    async fn errors_name_the_line_and_the_function() {
        let text = "def work():\n def inner(x):\n  return 1 + x\n end\n inner(True)\nend";
        let expected = "line 3, in inner: a whole number and a truth value cannot be combined so";
        assert_eq!(outcome(text).await.trouble(), expected);
        for (text, expected) in [
            ("x = 1 % 0", "line 1: division by zero"),
            ("x = 9223372036854775807 + 1", "line 1: the result is too large for a number"),
            ("fly()", "line 1: there is no function fly"),
            ("x = [1]\nx[1] = 2", "line 2: there is no element 1"),
            ("x = [1][-1]", "line 1: an index of -1 is before the first element"),
            ("if 1:\nend", "line 1: True or False is needed here, not a whole number"),
            ("kill True", "line 1: a thread is needed here, not a truth value"),
            ("run f()", "line 1: there is no thread f"),
            ("thread t():\nend\nt()", "line 3: t is a thread: it is started with run"),
            ("def f(a):\nend\nf()", "line 3: f needs the argument a"),
            ("def f(a):\nend\nf(1, 2)", "line 3: f has 1 arguments, not 2"),
            ("def f(a):\nend\nf(1, a=2)", "line 3: f has no argument a to be set"),
            ("sqrt(-1)", "line 1: sqrt has no value for these arguments"),
        ] {
            assert_eq!(outcome(text).await.trouble(), expected);
        }
    }

    #[tokio::test]
    async fn endless_recursion_and_growth_are_errors() {
        let plain = outcome("def f(n):\n return 1 + f(n + 1)\nend\nsay(f(0))").await;
        assert!(plain.trouble().contains("too deep"), "{}", plain.trouble());
        for open in ["[", "-", "f(", "abs(", "1 + (", "not (", "x[", "p[0, 0, 0, 0, 0, "] {
            let close = if open.contains('[') { "]" } else { ")" }.repeat(if open == "-" { 0 } else { 45 });
            let returned = format!("{}f(){close}", open.repeat(45));
            let program = format!("x = [1]\ndef f(n=0):\n return {returned}\nend\nf()");
            assert!(outcome(&program).await.trouble().contains("too deep"), "{open}");
        }
        for open in ["if True:\n", "while True:\n"] {
            let program = format!("def f():\n{}f()\n{}end\nf()", open.repeat(45), "end\n".repeat(45));
            assert!(outcome(&program).await.trouble().contains("too deep"));
        }
        assert!(outcome("def f(a=f()):\nend\nf()").await.trouble().contains("too deep"));
        let fine = "def sum(n):\n if n == 0:\n  return 0\n else:\n  return n + sum(n - 1)\n end\nend\nsay(sum(90))";
        assert_eq!(said(fine).await, "4095");
        let many: String = (0..300).map(|n| format!("x{n} = a\n")).collect();
        let list = format!("a = [0{}]\n", ", 0".repeat(4000));
        assert!(outcome(&format!("{list}{many}")).await.trouble().contains("hold more"));
        let freed = format!("{list}def f():\n b = a\nend\ni = 0\nwhile i < 300:\n f()\n i = i + 1\nend\nsay(i)");
        assert_eq!(said(&freed).await, "300");
        assert!(outcome(&format!("{list}b = [a, a]")).await.trouble().contains("together"));
        assert!(outcome("x = 'a'\nwhile True:\n x = str_cat(x, x)\nend").await.trouble().contains("together"));
        assert!(outcome("x = [1]\nwhile True:\n x = [x, x]\nend").await.trouble().contains("together"));
        assert!(outcome("x = [1]\nwhile True:\n x[0] = x\nend").await.trouble().contains("nested"));
        let threads = "thread t():\n run t()\n run t()\n wait()\nend\njoin run t()\nwait()";
        assert!(outcome(threads).await.trouble().contains("threads at once"));
    }

    #[tokio::test]
    async fn threads_run_beside_the_program() {
        let text = "def work():\n thread tick():\n  while True:\n   ticks = ticks + 1\n   wait()\n  end\n end\n thread tell(what):\n  \
                    wait()\n  say(what)\n end\n ticks = 0\n t = run tick()\n say(t == 0)\n x = run tell('told')\n join x\n \
                    kill t\n old = ticks\n wait()\n wait()\n say(old > 0 and old == ticks)\n kill t\n join t\n \
                    global y = run tick()\nend";
        assert_eq!(said(text).await, "False told True");
    }

    #[tokio::test]
    async fn killing_a_thread_drops_its_call_first() {
        let text = "thread t():\n hold()\nend\nx = run t()\nwait()\nkill x\nsay('killed')\ny = run t()\nwait()\nsay('end')";
        assert_eq!(said(text).await, "killed end".replace("killed", "let go killed") + " let go");
        let own = "thread t():\n kill me\n say('never')\nend\nme = run t()\njoin me\nsay('joined')";
        assert_eq!(said(own).await, "joined");
        assert!(outcome("thread t():\n join me\nend\nme = run t()\nwait()").await.trouble().contains("own end"));
    }

    #[tokio::test]
    async fn a_thread_can_end_the_program() {
        let broken = outcome("thread t():\n wait()\n fly()\nend\nrun t()\nhold()").await;
        assert_eq!((broken.said.as_str(), broken.trouble()), ("let go", "line 3, in t: there is no function fly".to_owned()));
        assert_eq!(said("thread t():\n halt\nend\nrun t()\nhold()").await, "let go");
    }

    #[tokio::test]
    async fn a_busy_program_lets_others_run_and_can_be_dropped() {
        let host = Rc::new(Listener::default());
        let text = "thread t():\n hold()\nend\nrun t()\nx = 0\nwhile True:\n x = x + 1\nend";
        let program = Rc::new(parse(text).unwrap());
        let turns = Cell::new(0);
        let other = async {
            for _ in 0..100 {
                turns.set(turns.get() + 1);
                tokio::task::yield_now().await;
            }
        };
        tokio::select! {
            _ = run(program, Rc::clone(&host)) => panic!("the program has no end"),
            () = other => {}
        }
        assert_eq!((turns.get(), host.said.borrow().join(" ")), (100, "let go".to_owned()));
        assert_eq!(Rc::strong_count(&host), 1);
    }

    #[tokio::test]
    async fn a_program_can_be_a_local_task_itself() {
        let host = Rc::new(Listener::default());
        let program = Rc::new(parse("thread t():\n hold()\nend\nrun t()\nwhile True:\n wait()\nend").unwrap());
        let tasks = LocalSet::new();
        let task = tasks.spawn_local(run(program, Rc::clone(&host)));
        let aborted = async {
            tokio::time::sleep(Duration::from_millis(5)).await;
            task.abort();
            task.await.is_err_and(|error| error.is_cancelled())
        };
        assert!(tasks.run_until(aborted).await);
        assert_eq!((host.said.borrow().join(" "), Rc::strong_count(&host)), ("let go".to_owned(), 1));
    }

    #[tokio::test]
    async fn recursion_without_loops_lets_others_run_too() {
        let text = "def f(n):\n if n > 0:\n  f(n - 1)\n  f(n - 1)\n end\nend\nf(60)";
        let run = outcome(text);
        assert!(tokio::time::timeout(Duration::from_millis(20), run).await.is_err());
    }
}
