# Reads every message of the segments of a record, and holds it against what the test wrote.
import glob, json, sys
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
import struct
documents = 0
clouds = {}
for path in sorted(glob.glob(sys.argv[1] + "/segments/*.mcap")):
    with open(path, "rb") as f:
        reader = make_reader(f, decoder_factories=[DecoderFactory()], validate_crcs=True)
        for schema, channel, message in reader.iter_messages():
            if channel.message_encoding == "json":
                document = json.loads(message.data)
                assert document["stamp_ns"] == message.log_time
                documents += 1
    with open(path, "rb") as f:
        reader = make_reader(f, decoder_factories=[DecoderFactory()])
        protobuf = [c.topic for c in reader.get_summary().channels.values() if c.message_encoding == "protobuf"]
        for schema, channel, message, decoded in reader.iter_decoded_messages(topics=protobuf):
            if schema.name == "foxglove.PointCloud":
                assert len(decoded.data) % decoded.point_stride == 0
                assert [f.name for f in decoded.fields][:3] == ["x", "y", "z"] and decoded.pose.orientation.w == 1
                clouds[channel.topic] = struct.unpack_from("<3f", decoded.data)
                if channel.topic == "/cloud/map/merged":
                    assert decoded.frame_id == "map" and len(decoded.data) == 4 * decoded.point_stride
                    assert [f.name for f in decoded.fields][3:] == ["red", "green", "blue", "alpha"]
            elif schema.name == "foxglove.FrameTransforms":
                assert all(t.parent_frame_id and t.child_frame_id for t in decoded.transforms)
                assert decoded.transforms[0].timestamp.seconds * 10**9 + decoded.transforms[0].timestamp.nanos == message.log_time
            elif channel.topic == "/plan":
                assert schema.name == "foxglove.Log" and (decoded.level, decoded.name) == (2, "plan")
                assert [line.split()[1] for line in decoded.message.splitlines()] == ["(move", "(observe"]
            elif schema.name == "foxglove.Log":
                assert decoded.level == 3 and "cup A" in decoded.message
            elif schema.name == "foxglove.RawImage":
                assert (decoded.width, decoded.height, decoded.step, decoded.encoding) == (3, 2, 6, "16UC1")
            elif schema.name == "foxglove.CompressedImage":
                assert decoded.format == "png" and decoded.data[1:4] == b"PNG"
            elif schema.name == "foxglove.SceneUpdate":
                assert [d.type for d in decoded.deletions] == [1]
                (cup,) = decoded.entities
                assert (cup.frame_id, cup.texts[0].text, cup.cubes[0].size.y) == ("map", "cup A 0.98", 0.08)
                assert cup.cubes[0].pose.position.z == 0.77 and cup.cubes[0].pose.orientation.w == 1 and cup.cubes[0].color.g == 0.8
            elif schema.name == "foxglove.Grid":
                assert (decoded.column_count, decoded.cell_size.x, decoded.row_stride, decoded.cell_stride) == (3, 0.05, 3, 1)
                assert decoded.pose.position.x == -2.5 and bytes(decoded.data) == bytes([0, 1, 0, 0, 0, 1])
            elif schema.name == "foxglove.CameraCalibration":
                assert channel.topic == "/calibration/" + decoded.frame_id and len(decoded.P) == 12 and len(decoded.R) == 9
                if decoded.frame_id == "left":
                    assert (decoded.width, decoded.height) == (640, 480)
                    assert list(decoded.K) == [525, 0, 319.5, 0, 526, 239.5, 0, 0, 1]
            else:
                raise SystemExit("unexpected " + schema.name)
            try:
                # The viewers' own schemas read the same bytes as the same.
                module = __import__("foxglove_schemas_protobuf." + schema.name.split(".")[1] + "_pb2", fromlist=["x"])
                official = getattr(module, schema.name.split(".")[1])()
                official.ParseFromString(message.data)
                assert str(official) == str(decoded), schema.name
            except ImportError:
                pass
print(documents, clouds["/cloud/side"])
