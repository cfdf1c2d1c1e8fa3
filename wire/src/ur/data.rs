//! Types and values of RTDE's variables.

/// The type of a variable.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DataType {
    /// One byte, 0 or 1.
    Bool,
    /// One byte.
    Uint8,
    /// Four bytes.
    Uint32,
    /// Eight bytes.
    Uint64,
    /// Four bytes, signed.
    Int32,
    /// An IEEE double.
    Double,
    /// Three doubles.
    Vector3d,
    /// Six doubles.
    Vector6d,
    /// Six signed integers of four bytes.
    Vector6int32,
    /// Six integers of four bytes.
    Vector6uint32,
}

/// The types with their names on the wire.
const TYPES: [(DataType, &str); 10] = [
    (DataType::Bool, "BOOL"),
    (DataType::Uint8, "UINT8"),
    (DataType::Uint32, "UINT32"),
    (DataType::Uint64, "UINT64"),
    (DataType::Int32, "INT32"),
    (DataType::Double, "DOUBLE"),
    (DataType::Vector3d, "VECTOR3D"),
    (DataType::Vector6d, "VECTOR6D"),
    (DataType::Vector6int32, "VECTOR6INT32"),
    (DataType::Vector6uint32, "VECTOR6UINT32"),
];

impl DataType {
    /// The type of this name; `None` if there is none, as for IN_USE and NOT_FOUND.
    pub fn of(name: &str) -> Option<Self> {
        TYPES.iter().find(|(_, known)| *known == name.trim()).map(|(kind, _)| *kind)
    }

    /// Its name on the wire.
    pub fn name(self) -> &'static str {
        TYPES.iter().find(|(kind, _)| *kind == self).map_or("", |(_, name)| *name)
    }

    /// Its number of values.
    pub fn values(self) -> usize {
        match self {
            DataType::Vector3d => 3,
            DataType::Vector6d | DataType::Vector6int32 | DataType::Vector6uint32 => 6,
            _ => 1,
        }
    }

    /// Bytes of one of its values.
    fn width(self) -> usize {
        match self {
            DataType::Bool | DataType::Uint8 => 1,
            DataType::Uint32 | DataType::Int32 | DataType::Vector6int32 | DataType::Vector6uint32 => 4,
            DataType::Uint64 | DataType::Double | DataType::Vector3d | DataType::Vector6d => 8,
        }
    }

    fn is_real(self) -> bool {
        matches!(self, DataType::Double | DataType::Vector3d | DataType::Vector6d)
    }

    fn is_signed(self) -> bool {
        matches!(self, DataType::Int32 | DataType::Vector6int32)
    }
}

/// The value of a variable.
#[derive(Debug, Clone, PartialEq)]
pub enum Datum {
    /// Doubles: one, three or six.
    Reals(Vec<f64>),
    /// Integers and booleans: one or six. A UINT64 beyond half its range is negative here.
    Integers(Vec<i64>),
}

impl Datum {
    /// Zeros of a type.
    pub fn zero(kind: DataType) -> Self {
        if kind.is_real() { Datum::Reals(vec![0.0; kind.values()]) } else { Datum::Integers(vec![0; kind.values()]) }
    }

    /// Its first value as a real number.
    pub fn real(&self) -> f64 {
        match self {
            Datum::Reals(values) => values.first().copied().unwrap_or_default(),
            Datum::Integers(values) => values.first().copied().unwrap_or_default() as f64,
        }
    }

    /// Its first value as an integer.
    pub fn integer(&self) -> i64 {
        match self {
            Datum::Reals(values) => values.first().copied().unwrap_or_default() as i64,
            Datum::Integers(values) => values.first().copied().unwrap_or_default(),
        }
    }

    /// Its first six values as real numbers; missing ones are zero.
    pub fn six(&self) -> [f64; 6] {
        let at = |k: usize| match self {
            Datum::Reals(values) => values.get(k).copied().unwrap_or_default(),
            Datum::Integers(values) => values.get(k).copied().unwrap_or_default() as f64,
        };
        std::array::from_fn(at)
    }

    /// Appends the value as this type to `bytes`; missing values are zero.
    pub fn encode(&self, kind: DataType, bytes: &mut Vec<u8>) {
        for k in 0..kind.values() {
            let (real, integer) = match self {
                Datum::Reals(values) => {
                    let value = values.get(k).copied().unwrap_or_default();
                    (value, value as i64)
                }
                Datum::Integers(values) => {
                    let value = values.get(k).copied().unwrap_or_default();
                    (value as f64, value)
                }
            };
            if kind.is_real() {
                bytes.extend_from_slice(&real.to_be_bytes());
            } else {
                bytes.extend_from_slice(&integer.to_be_bytes()[8 - kind.width()..]);
            }
        }
    }

    /// Takes a value of this type from the front of `bytes`; `None` if they are too few.
    pub fn decode(kind: DataType, bytes: &mut &[u8]) -> Option<Self> {
        let width = kind.width();
        let (mine, rest) = bytes.split_at_checked(width * kind.values())?;
        *bytes = rest;
        let values = mine.chunks_exact(width).map(|value| {
            let is_negative = kind.is_signed() && value.first().is_some_and(|byte| byte & 0x80 != 0);
            let mut whole = if is_negative { [0xff; 8] } else { [0; 8] };
            whole[8 - width..].copy_from_slice(value);
            whole
        });
        Some(if kind.is_real() {
            Datum::Reals(values.map(f64::from_be_bytes).collect())
        } else {
            Datum::Integers(values.map(i64::from_be_bytes).collect())
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_type_survives_the_wire() {
        for (kind, name) in TYPES {
            assert_eq!(DataType::of(name), Some(kind));
            assert_eq!(kind.name(), name);
            let value = if kind.is_real() {
                Datum::Reals((0..kind.values()).map(|k| 0.1 * k as f64 - 0.2).collect())
            } else if kind.is_signed() {
                Datum::Integers((0..kind.values()).map(|k| k as i64 - 3).collect())
            } else {
                Datum::Integers(vec![1; kind.values()])
            };
            let mut bytes = Vec::new();
            value.encode(kind, &mut bytes);
            assert_eq!(bytes.len(), kind.width() * kind.values());
            let mut rest = &bytes[..];
            assert_eq!(Datum::decode(kind, &mut rest), Some(value), "{name}");
            assert!(rest.is_empty());
            assert_eq!(Datum::decode(kind, &mut &bytes[1..]), None);
        }
        assert_eq!(DataType::of("NOT_FOUND"), None);
    }
}
