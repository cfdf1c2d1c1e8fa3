//! A station file is read, or refused with file, line, key and remedy.

use std::time::Duration;

use calibench_readout::{AbbSettings, Controller, End, JointUnit, Station, read_station};

fn read(text: &str) -> Result<Station, String> {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("station.toml");
    std::fs::write(&file, format!("format = \"calibench-station/1\"\n{text}")).unwrap();
    read_station(&file).map_err(|e| format!("station.toml{}", e.to_string().split_once("station.toml").unwrap().1))
}

#[test]
fn what_is_not_said_has_a_usual_value() {
    let station = read("controller.kind = \"abb\"\ncontroller.address = \"192.168.125.1\"").unwrap();
    let Controller::Abb(abb) = &station.controller else { panic!("{station:?}") };
    assert_eq!((abb.unit.as_str(), abb.log_in.as_ref().unwrap().user.as_str()), (AbbSettings::UNIT, AbbSettings::USER[0]));
    assert_eq!((station.instrument.clone(), station.unit(0), station.still.is_automatic), (None, JointUnit::Deg, false));
    let station = read(
        "controller.kind = \"ur\"\ncontroller.address = \"10.0.0.2:30004\"\n[instrument]\nlisten = \"0.0.0.0:5000\"\ntrigger = 'M\\r\\n'\naverage_s = 2\n[still]\nautomatic = true",
    )
    .unwrap();
    let instrument = station.instrument.clone().unwrap();
    assert_eq!(instrument.end, End::Listen("0.0.0.0:5000".into()));
    assert_eq!((instrument.trigger.as_deref(), instrument.average), (Some("M\r\n"), Duration::from_secs(2)));
    assert_eq!(station.unit(3), JointUnit::Rad);
}

#[test]
fn what_is_wrong_is_named_with_its_remedy() {
    let typed = "controller.kind = \"typed\"\n";
    let text = "[controller]\nkind = \"text\"\naddress = \"h:1\"\n";
    for (text, said) in [
        ("controller.kind = \"yaskawa\"".to_owned(), "station.toml:2: controller.kind: `yaskawa` is not known"),
        ("controller.kind = \"kuka\"".to_owned(), "controller.address: is missing; add `address = \"HOST:7000\"`"),
        (
            "controller.kind = \"kuka\"\ncontroller.address = \"h\"".to_owned(),
            "station.toml:3: controller.address: 'h' is not an address; give it as HOST:PORT",
        ),
        (
            "controller.kind = \"fanuc\"\ncontroller.address = \"http://h\"".to_owned(),
            "station.toml:3: controller.address: 'http://h' is not an address; give it as HOST or HOST:PORT, without http://",
        ),
        (
            "controller.kind = \"fanuc\"\ncontroller.address = \"h\"\ncontroller.unit = \"x\"".to_owned(),
            "station.toml:4: controller.unit: is not a key of this kind",
        ),
        (
            "controller.kind = \"abb\"\ncontroller.address = \"h\"\ncontroller.unit = \"a b\"".to_owned(),
            "controller.unit: 'a b' is not a mechanical unit",
        ),
        (format!("{text}line = \"{{q1}}{{q2}}\""), "station.toml:5: controller.line: nothing separates '{q1}' and '{q2}'"),
        (format!("{text}line = \"{{j1}},{{q2}}\""), "controller.line: '{j1}' is not a field"),
        (format!("{text}line = \"{{q2}}\""), "controller.line: has no field {q1}"),
        (text.to_owned(), "controller.line: is missing"),
        (format!("{text}line = \"{{q1}} {{q3}}\""), "controller.line: has joints beyond a gap after {q1}"),
        (
            format!("{text}line = \"{{q1}} {{q2}}\"\nunits = [\"rad\"]"),
            "station.toml:6: controller.units: has 1 units, and there are 2 joints",
        ),
        (format!("{typed}controller.joints = 40"), "controller.joints: 40 is not a number of joints; give 1 to 12"),
        (format!("{typed}still.automatic = true"), "station.toml:3: still.automatic: what is typed is not measured by itself"),
        (format!("{typed}still.wait_s = -1"), "still.wait_s: -1 is not a waiting time"),
        (format!("{typed}still.within_deg = 0"), "still.within_deg: 0 is not positive"),
        (format!("{typed}instrument.trigger = \"M\""), "instrument.trigger: is for an instrument that is connected"),
        (
            format!("{typed}[instrument]\naddress = \"h:1\"\nlisten = \"h:2\""),
            "station.toml:5: instrument.listen: is given beside `address`",
        ),
        (format!("{typed}[instrument]\naddress = \"h:1\"\nline = \"{{x}},{{y}}\""), "instrument.line: has no field {z}"),
        (format!("{typed}[instrument]\naddress = \"h:1\"\nunit = \"feet\""), "instrument.unit: `feet` is not known"),
        (format!("{typed}[instrument]\nadress = \"h:1\""), "instrument.adress: there is no such key; "),
    ] {
        let error = read(&text).unwrap_err();
        assert!(error.contains(said), "{text}\n{error}\n{said}");
    }
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("station.toml");
    std::fs::write(&file, "format = \"calibench-station/9\"\ncontroller.kind = \"typed\"").unwrap();
    let said = read_station(&file).unwrap_err().to_string();
    assert!(said.contains("station.toml:1: format: 'calibench-station/9' is not read here"), "{said}");
}
