//! The variables of RTDE and their types, as the manufacturer's page lists them.

use super::DataType::{self, Bool, Double, Int32, Uint8, Uint32, Uint64, Vector3d, Vector6d, Vector6int32};

/// Outputs of the controller.
const OUTPUTS: [(DataType, &str); 7] = [
    (
        Double,
        "timestamp actual_execution_time speed_scaling target_speed_fraction actual_momentum actual_main_voltage \
         actual_robot_voltage actual_robot_current standard_analog_input0 standard_analog_input1 standard_analog_output0 \
         standard_analog_output1 io_current euromap67_24V_voltage euromap67_24V_current tool_analog_input0 \
         tool_analog_input1 tool_output_current tool_temperature tcp_force_scalar joint_position_deviation_ratio \
         collision_detection_ratio payload actual_robot_energy_consumed actual_robot_braking_energy_dissipated",
    ),
    (
        Vector6d,
        "target_q target_qd target_qdd target_current target_moment actual_q actual_qd actual_current \
         actual_current_window actual_current_as_torque joint_control_output actual_TCP_pose actual_TCP_speed \
         actual_TCP_force target_TCP_pose target_TCP_speed joint_temperatures actual_joint_voltage ft_raw_wrench \
         wrench_calc_from_currents payload_inertia tcp_offset",
    ),
    (Vector3d, "actual_tool_accelerometer elbow_position elbow_velocity payload_cog target_gravity"),
    (Uint64, "actual_digital_input_bits actual_digital_output_bits control_step"),
    (Int32, "robot_mode safety_mode safety_status tool_output_voltage time_scale_source encoder0_raw encoder1_raw"),
    (
        Uint32,
        "runtime_state robot_status_bits safety_status_bits analog_io_types tool_mode tool_analog_input_types \
         output_bit_registers0_to_31 output_bit_registers32_to_63 input_bit_registers0_to_31 input_bit_registers32_to_63 \
         script_control_line euromap67_input_bits euromap67_output_bits",
    ),
    (Uint8, "tool_output_mode tool_digital_output0_mode tool_digital_output1_mode"),
];

/// Inputs of the controller.
const INPUTS: [(DataType, &str); 3] = [
    (Double, "speed_slider_fraction standard_analog_output_0 standard_analog_output_1"),
    (Uint32, "speed_slider_mask input_bit_registers0_to_31 input_bit_registers32_to_63"),
    (
        Uint8,
        "standard_digital_output_mask standard_digital_output configurable_digital_output_mask \
         configurable_digital_output standard_analog_output_mask standard_analog_output_type tool_digital_output_mask \
         tool_digital_output",
    ),
];

/// Number of the general-purpose registers of integers and of doubles; those of booleans go from 64 to 127.
const REGISTERS: usize = 48;

/// The type of an output of the controller; `None` if there is none of this name.
pub fn output_type(name: &str) -> Option<DataType> {
    if name == "joint_mode" {
        return Some(Vector6int32);
    }
    listed(&OUTPUTS, name).or_else(|| register(name, "output")).or_else(|| register(name, "input"))
}

/// The type of an input of the controller; `None` if there is none of this name.
pub fn input_type(name: &str) -> Option<DataType> {
    if name == "external_force_torque" {
        return Some(Vector6d);
    }
    listed(&INPUTS, name).or_else(|| register(name, "input"))
}

fn listed(list: &[(DataType, &str)], name: &str) -> Option<DataType> {
    list.iter().find(|(_, names)| names.split_ascii_whitespace().any(|known| known == name)).map(|(kind, _)| *kind)
}

/// The type of a general-purpose register, such as `input_int_register_24`.
fn register(name: &str, side: &str) -> Option<DataType> {
    let name = name.strip_prefix(side)?.strip_prefix('_')?;
    let (kind, number) = name.split_once("_register_")?;
    let number: usize = number.parse().ok()?;
    match kind {
        "bit" if (64..128).contains(&number) => Some(Bool),
        "int" if number < REGISTERS => Some(Int32),
        "double" if number < REGISTERS => Some(Double),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn variables_have_the_types_of_the_list() {
        let cases = [
            ("actual_q", Some(Vector6d)),
            ("robot_mode", Some(Int32)),
            ("runtime_state", Some(Uint32)),
            ("joint_mode", Some(Vector6int32)),
            ("payload_cog", Some(Vector3d)),
            ("output_int_register_47", Some(Int32)),
            ("output_int_register_48", None),
            ("output_bit_register_64", Some(Bool)),
            ("output_bit_register_63", None),
            ("input_double_register_24", Some(Double)),
            ("speed_slider_mask", None),
            ("", None),
        ];
        for (name, kind) in cases {
            assert_eq!(output_type(name), kind, "{name}");
        }
        assert_eq!(input_type("speed_slider_mask"), Some(Uint32));
        assert_eq!(input_type("output_int_register_3"), None);
        assert_eq!(input_type("actual_q"), None);
    }
}
