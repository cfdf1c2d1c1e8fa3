//! Joints, points and poses in the messages of a topic, found by the definition of their type: whatever package a message is from,
//! what it states as a `geometry_msgs` point or pose is one.

use std::collections::{BTreeMap, HashMap};

use byteorder::{BigEndian, LittleEndian};
use re_cdr::CdrReader;
use re_ros_msg::MessageSchema;
use re_ros_msg::deserialize::primitive_array::PrimitiveArray;
use re_ros_msg::deserialize::{TypeResolver, Value, decode_message};
use re_ros_msg::message_spec::{ComplexType, MessageSpecification, Type, message_package};

use crate::definitions::known;

/// Deepest nesting that is followed: a definition may hold itself.
const DEEPEST: usize = 8;
/// Most places in one message: beyond them it is a cloud of points.
const MOST_PLACES: usize = 64;
/// Bytes before the data: they say how these are encoded.
const ENCAPSULATION: usize = 4;
/// Names of fields that add nothing to the name of what they hold.
const PLAIN: [&str; 7] = ["pose", "point", "position", "transform", "translation", "vector", "transforms"];
/// Fields that name an element of a list, the best first.
const NAMES: [&str; 8] = ["child_frame_id", "marker_id", "tag_id", "rigid_body_name", "name", "id", "marker_index", "label"];

/// What a message states at a time.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stated {
    /// Time of the data, s; `None` if none is stated.
    pub time: Option<f64>,
    pub content: Content,
}

/// The statement.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Content {
    /// Names and positions of joints, rad or m.
    Joints(Vec<String>, Vec<f64>),
    /// A point, m, and an orientation as a quaternion x, y, z, w, with its name within the message.
    Place(String, [f64; 3], Option<[f64; 4]>),
}

/// Decodes the messages of one type.
pub(crate) struct Decoder {
    schema: MessageSchema,
    /// Places of the parts among the dependencies, by package and name without `msg`, which a definition may write or leave out.
    parts: HashMap<String, usize>,
}

/// The name of a type as `package/Type`.
fn plain(name: &str) -> String {
    name.replace("/msg/", "/")
}

impl TypeResolver for Decoder {
    fn resolve(&self, scope: &MessageSpecification, part: &ComplexType) -> Option<&MessageSpecification> {
        let name = match part {
            ComplexType::Absolute { package, name } => format!("{package}/{name}"),
            ComplexType::Relative { name } => format!("{}/{name}", message_package(&scope.name).unwrap_or_default()),
        };
        self.parts.get(&plain(&name)).map(|&k| &self.schema.dependencies[k])
    }
}

impl Decoder {
    /// The decoder of a type by its definition, or by that which is known of it; `None` if it states no joints and no places.
    pub fn new(type_name: &str, definition: Option<&str>) -> Option<Self> {
        let stated = definition.and_then(|text| MessageSchema::parse(type_name, text).ok());
        let schema = stated.or_else(|| known(type_name))?;
        let parts = schema.dependencies.iter().enumerate().map(|(k, part)| (plain(&part.name), k)).collect();
        let decoder = Decoder { schema, parts };
        decoder.tells(&decoder.schema.spec, 0).then_some(decoder)
    }

    /// True if a message of this type can hold joints or places.
    fn tells(&self, spec: &MessageSpecification, depth: usize) -> bool {
        if is_joints(spec) || kind_of(spec).is_some() {
            return true;
        }
        let inner = |ty: &Type| match ty {
            Type::Complex(complex) => Some(complex.clone()),
            Type::Array { ty, .. } => match ty.as_ref() {
                Type::Complex(complex) => Some(complex.clone()),
                _ => None,
            },
            Type::BuiltIn(_) => None,
        };
        let parts = spec.fields.iter().filter_map(|field| inner(&field.ty));
        depth < DEEPEST && parts.into_iter().any(|part| self.resolve(spec, &part).is_some_and(|of| self.tells(of, depth + 1)))
    }

    /// What a message states, or why it cannot be read.
    pub fn read(&self, bytes: &[u8]) -> Result<Vec<Stated>, String> {
        let (Some(&[_, form, ..]), Some(data)) = (bytes.first_chunk::<ENCAPSULATION>(), bytes.get(ENCAPSULATION..)) else {
            return Err("a message is too short".into());
        };
        // The second byte: 0 is big-endian, 1 little-endian, of the plain representation.
        let value = match form {
            0 => decode_message(&mut CdrReader::<BigEndian>::new(data), &self.schema.spec, self),
            1 => decode_message(&mut CdrReader::<LittleEndian>::new(data), &self.schema.spec, self),
            _ => return Err(format!("a message has the representation {form}, and only plain CDR is read")),
        };
        let value = value.map_err(|e| format!("a message is not as its type says: {e}"))?;
        let mut found = Found { resolver: self, all: Vec::new() };
        found.walk(&self.schema.spec, &value, &Place { label: String::new(), time: None, depth: 0 });
        // Joints without a name or a number are no joints; what one marker of many lacks is nothing to the others.
        match is_joints(&self.schema.spec) && found.all.is_empty() {
            true => Err("a message states no position for each name".into()),
            false => Ok(found.all),
        }
    }
}

/// The name of a type without its package.
fn short(spec: &MessageSpecification) -> &str {
    spec.name.rsplit('/').next().unwrap_or_default()
}

fn is_joints(spec: &MessageSpecification) -> bool {
    short(spec) == "JointState"
}

/// Kind of a type that states a place.
#[derive(Clone, Copy)]
enum Kind {
    Pose,
    Transform,
    Point,
}

fn kind_of(spec: &MessageSpecification) -> Option<Kind> {
    let is_geometry = message_package(&spec.name).is_some_and(|package| package.starts_with("geometry_msgs"));
    match short(spec) {
        "Pose" if is_geometry => Some(Kind::Pose),
        "Transform" if is_geometry => Some(Kind::Transform),
        "Point" | "Point32" if is_geometry => Some(Kind::Point),
        _ => None,
    }
}

/// Where in a message a value stands.
struct Place {
    label: String,
    time: Option<f64>,
    depth: usize,
}

struct Found<'a> {
    resolver: &'a Decoder,
    all: Vec<Stated>,
}

type Fields = BTreeMap<String, Value>;

impl Found<'_> {
    fn walk(&mut self, spec: &MessageSpecification, value: &Value, place: &Place) {
        let Value::Message(fields) = value else { return };
        if place.depth > DEEPEST || self.all.len() >= MOST_PLACES {
            return;
        }
        let time = header_time(fields).or(place.time);
        let content = if is_joints(spec) {
            joints(fields)
        } else {
            kind_of(spec)
                .and_then(|kind| place_of(kind, fields))
                .map(|(at, turn)| Content::Place(place.label.clone(), at, turn))
        };
        if let Some(content) = content {
            self.all.push(Stated { time, content });
            return;
        }
        if is_joints(spec) || kind_of(spec).is_some() {
            return;
        }
        let own = match (frame(fields), fields.get("child_frame_id")) {
            (Some(parent), Some(Value::String(child))) => format!("{parent}>{child}"),
            _ => place.label.clone(),
        };
        for field in &spec.fields {
            let Some(value) = fields.get(&field.name) else { continue };
            let label = if PLAIN.contains(&field.name.as_str()) { own.clone() } else { joined(&own, &field.name) };
            match (&field.ty, value) {
                (Type::Complex(part), value) => {
                    // What is stamped with a vector is a point; other vectors are velocities and forces.
                    if short(spec) == "Vector3Stamped" && field.name == "vector" {
                        if let Value::Message(fields) = value
                            && let Some(at) = three(fields)
                        {
                            self.all.push(Stated { time, content: Content::Place(label, at, None) });
                        }
                        continue;
                    }
                    if let Some(of) = self.resolver.resolve(spec, part) {
                        self.walk(of, value, &Place { label, time, depth: place.depth + 1 });
                    }
                }
                (Type::Array { ty, .. }, Value::Array(values) | Value::Sequence(values)) => {
                    let Type::Complex(part) = ty.as_ref() else { continue };
                    // The points of a drawing are no measurements.
                    if short(spec) == "Marker" {
                        continue;
                    }
                    let Some(of) = self.resolver.resolve(spec, part) else { continue };
                    for (k, value) in values.iter().enumerate() {
                        let label = format!("{label}[{}]", element(value).unwrap_or_else(|| k.to_string()));
                        let label = label.trim_start_matches('/').to_owned();
                        self.walk(of, value, &Place { label, time, depth: place.depth + 1 });
                    }
                }
                _ => {}
            }
        }
    }
}

fn joined(label: &str, field: &str) -> String {
    if label.is_empty() { field.to_owned() } else { format!("{label}/{field}") }
}

/// The name that an element of a list states.
fn element(value: &Value) -> Option<String> {
    let Value::Message(fields) = value else { return None };
    let text = |value: &Value| match value {
        Value::String(text) if !text.is_empty() => Some(text.clone()),
        Value::String(_) => None,
        value => whole(value).map(|v| v.to_string()),
    };
    let name = NAMES.iter().find_map(|name| fields.get(*name).and_then(text))?;
    let within = fields.get("ns").and_then(text);
    Some(within.map_or(name.clone(), |ns| format!("{ns}/{name}")))
}

fn frame(fields: &Fields) -> Option<String> {
    let Some(Value::Message(header)) = fields.get("header") else { return None };
    match header.get("frame_id") {
        Some(Value::String(frame)) => Some(frame.clone()),
        _ => None,
    }
}

/// The time of a header, s; `None` without one, and where it was not filled in.
fn header_time(fields: &Fields) -> Option<f64> {
    let Some(Value::Message(header)) = fields.get("header") else { return None };
    let Some(Value::Message(stamp)) = header.get("stamp") else { return None };
    let [seconds, nanoseconds] = ["sec", "nanosec"].map(|name| stamp.get(name).and_then(whole).unwrap_or(0));
    // Seconds and nanoseconds of a header are 32 bits each.
    (seconds != 0 || nanoseconds != 0).then_some(seconds as f64 + nanoseconds as f64 * 1e-9)
}

fn whole(value: &Value) -> Option<i64> {
    match *value {
        Value::I8(v) => Some(v.into()),
        Value::U8(v) => Some(v.into()),
        Value::I16(v) => Some(v.into()),
        Value::U16(v) => Some(v.into()),
        Value::I32(v) => Some(v.into()),
        Value::U32(v) => Some(v.into()),
        Value::I64(v) => Some(v),
        Value::U64(v) => i64::try_from(v).ok(),
        _ => None,
    }
}

fn number(value: &Value) -> Option<f64> {
    match *value {
        Value::F64(v) => Some(v),
        Value::F32(v) => Some(v.into()),
        _ => None,
    }
}

fn three(fields: &Fields) -> Option<[f64; 3]> {
    let [x, y, z] = ["x", "y", "z"].map(|name| fields.get(name).and_then(number));
    Some([x?, y?, z?])
}

/// The point of a place and its orientation.
type PointAndTurn = ([f64; 3], Option<[f64; 4]>);

fn place_of(kind: Kind, fields: &Fields) -> Option<PointAndTurn> {
    let part = |name: &str| match fields.get(name) {
        Some(Value::Message(part)) => Some(part),
        _ => None,
    };
    let turn = |part: &Fields| {
        let [x, y, z, w] = ["x", "y", "z", "w"].map(|name| part.get(name).and_then(number));
        Some([x?, y?, z?, w?])
    };
    match kind {
        Kind::Point => Some((three(fields)?, None)),
        Kind::Pose => Some((three(part("position")?)?, turn(part("orientation")?))),
        Kind::Transform => Some((three(part("translation")?)?, turn(part("rotation")?))),
    }
}

fn joints(fields: &Fields) -> Option<Content> {
    let (Value::PrimitiveSeq(PrimitiveArray::String(names)), Value::PrimitiveSeq(PrimitiveArray::F64(positions))) =
        (fields.get("name")?, fields.get("position")?)
    else {
        return None;
    };
    let are_whole = names.len() == positions.len() && names.iter().all(|name| !name.is_empty());
    (are_whole && !names.is_empty() && positions.iter().all(|v| v.is_finite()))
        .then(|| Content::Joints(names.clone(), positions.clone()))
}
