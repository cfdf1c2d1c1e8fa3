//! The functions of the language that need no robot.

use super::arguments::Arguments;
use super::trouble::Trouble;
use super::value::Value;

/// The result of a function of the language; none if it has no function of this name.
pub(crate) fn call(name: &str, arguments: &Arguments) -> Option<Result<Value, Trouble>> {
    mathematics(name, arguments).or_else(|| others(name, arguments))
}

fn mathematics(name: &str, arguments: &Arguments) -> Option<Result<Value, Trouble>> {
    let one = |function: fn(f64) -> f64| number(arguments, 0, "f").map(function);
    let two = |function: fn(f64, f64) -> f64| Ok(function(number(arguments, 0, "x")?, number(arguments, 1, "y")?));
    let result = match name {
        "sin" => one(f64::sin),
        "cos" => one(f64::cos),
        "tan" => one(f64::tan),
        "asin" => one(f64::asin),
        "acos" => one(f64::acos),
        "atan" => one(f64::atan),
        "sqrt" => one(f64::sqrt),
        "exp" => one(f64::exp),
        "d2r" => one(f64::to_radians),
        "r2d" => one(f64::to_degrees),
        "atan2" => two(f64::atan2),
        "pow" => two(f64::powf),
        "log" => two(|base, value| value.ln() / base.ln()),
        _ => return None,
    };
    Some(result.and_then(|result| {
        let finite = result.is_finite().then_some(Value::Float(result));
        finite.ok_or_else(|| Trouble::new(format!("{name} has no value for these arguments")))
    }))
}

fn others(name: &str, arguments: &Arguments) -> Option<Result<Value, Trouble>> {
    Some(match name {
        "floor" => number(arguments, 0, "f").and_then(|number| whole(number.floor())),
        "ceil" => number(arguments, 0, "f").and_then(|number| whole(number.ceil())),
        "abs" => absolute(arguments),
        "norm" => norm(arguments),
        "length" | "get_list_length" => length(arguments),
        "str_len" => text(arguments, 0, "str").map(|text| count(text.chars().count())),
        "to_str" => value(arguments, 0, "val").map(|value| Value::Text(value.to_string())).and_then(Value::limited),
        "to_num" => to_num(arguments),
        "str_cat" => concatenate(arguments),
        _ => return None,
    })
}

fn value<'a>(arguments: &'a Arguments, position: usize, name: &str) -> Result<&'a Value, Trouble> {
    arguments.get(position, name).ok_or_else(|| Trouble::new(format!("the argument {name} is missing")))
}

fn number(arguments: &Arguments, position: usize, name: &str) -> Result<f64, Trouble> {
    let value = value(arguments, position, name)?;
    value.number().ok_or_else(|| Trouble::new(format!("the argument {name} must be a number, not {}", value.kind())))
}

fn text<'a>(arguments: &'a Arguments, position: usize, name: &str) -> Result<&'a str, Trouble> {
    let value = value(arguments, position, name)?;
    value.text().ok_or_else(|| Trouble::new(format!("the argument {name} must be a text, not {}", value.kind())))
}

fn whole(number: f64) -> Result<Value, Trouble> {
    Value::Float(number).integer().map(Value::Integer).ok_or_else(|| Trouble::new("the number is too large to be whole"))
}

fn count(number: usize) -> Value {
    Value::Integer(i64::try_from(number).unwrap_or(i64::MAX))
}

fn absolute(arguments: &Arguments) -> Result<Value, Trouble> {
    match value(arguments, 0, "f")? {
        Value::Integer(number) => Ok(Value::Integer(number.saturating_abs())),
        _ => Ok(Value::Float(number(arguments, 0, "f")?.abs())),
    }
}

fn norm(arguments: &Arguments) -> Result<Value, Trouble> {
    let value = value(arguments, 0, "a")?;
    let numbers = value.number().map(|number| vec![number]).or_else(|| value.numbers());
    let numbers = numbers.ok_or_else(|| Trouble::new(format!("{} has no norm", value.kind())))?;
    Ok(Value::Float(numbers.iter().fold(0.0_f64, |norm, number| norm.hypot(*number))))
}

fn length(arguments: &Arguments) -> Result<Value, Trouble> {
    match value(arguments, 0, "v")? {
        Value::List(elements) => Ok(count(elements.len())),
        Value::Pose(pose) => Ok(count(pose.len())),
        other => Err(Trouble::new(format!("{} has no length", other.kind()))),
    }
}

fn to_num(arguments: &Arguments) -> Result<Value, Trouble> {
    let text = text(arguments, 0, "str")?.trim();
    let whole = text.parse().ok().map(Value::Integer);
    let fractional = || text.parse().ok().filter(|number: &f64| number.is_finite()).map(Value::Float);
    whole.or_else(fractional).ok_or_else(|| Trouble::new("the text is not a number"))
}

fn concatenate(arguments: &Arguments) -> Result<Value, Trouble> {
    let mut text = value(arguments, 0, "op1")?.to_string();
    text.push_str(&value(arguments, 1, "op2")?.to_string());
    Value::Text(text).limited()
}
