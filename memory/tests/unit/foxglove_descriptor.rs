//! Tests of `foxglove::descriptor`.

/// The schemas equal those in segments of earlier formats.
#[test]
fn schemas_are_those_of_earlier_segments() {
    let segment = include_bytes!("../../tests/formats/1.mcap");
    let summary = mcap::Summary::read(segment).unwrap().unwrap();
    let mut same = 0;
    for schema in summary.schemas.values().filter(|s| s.encoding == descry_memory::foxglove::PROTOBUF) {
        let name = descry_memory::foxglove::descriptor::MESSAGES
            .iter()
            .find(|(name, _)| *name == schema.name)
            .unwrap()
            .0;
        assert_eq!(descry_memory::foxglove::descriptor::set(name), schema.data.as_ref(), "{name}");
        same += 1;
    }
    assert!(same >= 2, "{same}");
    let fields: usize = descry_memory::foxglove::descriptor::MESSAGES
        .iter()
        .map(|(name, _)| descry_memory::foxglove::descriptor::fields(name).len())
        .sum();
    let listed: usize =
        descry_memory::foxglove::descriptor::MESSAGES.iter().map(|(_, text)| text.matches('=').count()).sum();
    assert_eq!(fields, listed, "every field is read");
}
