// Each class of mistake in a machine's file: its place, what was found, what would be right.

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "core/config/load.h"
#include "core/config/test_family.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;
using ::testing::Not;

std::string ErrorsOf(const std::string& text) {
  ConfigErrors errors("m.yaml");
  EXPECT_FALSE(ParseConfig(text, errors));
  return errors.Text();
}

struct Mistake {
  const char* bus;
  const char* device;
  const char* message;  // of the first error
};

class MistakeTest : public ::testing::TestWithParam<Mistake> {};

TEST_P(MistakeTest, NamesPlaceValueAndWhatIsRight) {
  EXPECT_THAT(ErrorsOf(test_family::Machine(GetParam().bus, GetParam().device)), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Device, MistakeTest,
    ::testing::Values(
        Mistake{
            "simulate: true", "unit: mn",
            "m.yaml:6:29: buses.b0.devices.axis1.unit: 'mn' is not one of count, turn, rad, deg, mm, m, um, inch"},
        Mistake{"simulate: true", "unit: mm",
                "m.yaml:6:15: buses.b0.devices.axis1.per_turn: is missing: unit mm needs the travel of one output "
                "turn in mm"},
        Mistake{"simulate: true", "unit: deg, per_turn: 180",
                "m.yaml:6:44: buses.b0.devices.axis1.per_turn: unit deg already defines the travel of a turn; for "
                "a gear "
                "use ratio: \"num:den\""},
        Mistake{"simulate: true", "unit: mm, per_turn: -5",
                "m.yaml:6:43: buses.b0.devices.axis1.per_turn: '-5' is not within 1e-09 to 1000000000 mm"},
        Mistake{
            "simulate: true", "ratio: '1/10'",
            "m.yaml:6:30: buses.b0.devices.axis1.ratio: '1/10' is not \"num:den\" with whole numbers 1 to 1000000"},
        Mistake{"simulate: true", "ratio: '1:0'", "buses.b0.devices.axis1.ratio: '1:0' is not \"num:den\""},
        Mistake{"simulate: true", "limits: {speed_rpm: 6001}",
                "m.yaml:6:43: buses.b0.devices.axis1.limits.speed_rpm: '6001' is not within 0.001 to 6000 rpm (the "
                "model's limit)"},
        Mistake{"simulate: true", "limits: {sped_rpm: 60}",
                "m.yaml:6:32: buses.b0.devices.axis1.limits: unknown key 'sped_rpm'; did you mean 'speed_rpm'?"},
        Mistake{"simulate: true", "model: st17, turns: signed",
                "m.yaml:6:43: buses.b0.devices.axis1.turns: model st17 counts no turns: leave the key out"},
        Mistake{"simulate: true", "direction: clockwise",
                "m.yaml:6:34: buses.b0.devices.axis1.direction: 'clockwise' is not one of ccw, cw"},
        Mistake{"simulate: true", "datum: {count: 5}",
                "m.yaml:6:31: buses.b0.devices.axis1.datum: unknown key 'count'; did you mean 'counts'?"},
        Mistake{"simulate: true", "datum: {}",
                "m.yaml:6:30: buses.b0.devices.axis1.datum: needs counts: the position, in counts after direction, "
                "that is 0"},
        Mistake{"simulate: true", "publish_hz: 1001",
                "m.yaml:6:35: buses.b0.devices.axis1.publish_hz: is above the bus's poll_hz: at most that many "
                "readings a second exist; lower it, or raise poll_hz"},
        Mistake{"simulate: true", "permit: false",
                "m.yaml:6:31: buses.b0.devices.axis1.permit: 'false' is not one of required, not_required"},
        Mistake{"simulate: true", "tag: A1 5",
                "m.yaml:6:28: buses.b0.devices.axis1.tag: 'A1 5' is not bytes in hex"},
        Mistake{"simulate: true", "polarity: 1",
                "m.yaml:6:23: buses.b0.devices.axis1: unknown key 'polarity'; known here: acknowledge, block, "
                "datum, "}));

INSTANTIATE_TEST_SUITE_P(
    Bus, MistakeTest,
    ::testing::Values(
        Mistake{"poll_hz: 20", "", "m.yaml:3:3: buses.b0.link.port: is missing: name the serial port"},
        Mistake{"link: {port: ttyUSB0}", "",
                "m.yaml:5:18: buses.b0.link.port: 'ttyUSB0' is no absolute path, e.g. /dev/ttyUSB0"},
        Mistake{"link: {port: /dev/a, baud: 300}", "",
                "m.yaml:5:32: buses.b0.link.baud: '300' is not within 1200 to 12000000 baud"},
        Mistake{"link: {port: /dev/a, parity: mark}", "",
                "m.yaml:5:34: buses.b0.link.parity: 'mark' is not one of none, even, odd"},
        Mistake{"link: {port: /dev/a, bits: 7}", "", "m.yaml:5:26: buses.b0.link: unknown key 'bits'"},
        Mistake{"link: /dev/a", "",
                "m.yaml:5:11: buses.b0.link: '/dev/a' is given where a mapping (key: value) is expected"},
        Mistake{"simulate: yes", "", "m.yaml:5:15: buses.b0.simulate: 'yes' is not true or false"},
        Mistake{
            "simulate: true\n    poll_hz: 19700", "",
            "m.yaml:6:14: buses.b0.poll_hz: 19700 Hz is more than the wire carries: one round takes 51 us; at most "
            "19607.8 Hz, or 0"},
        Mistake{"simulate: true\n    poll_hz: 1000 Hz", "",
                "m.yaml:6:14: buses.b0.poll_hz: '1000 Hz' is not a number (0 to 20000 Hz (0: as fast as the bus "
                "allows))"},
        Mistake{"simulate: true\n    phase_us: 1001", "",
                "m.yaml:6:15: buses.b0.phase_us: '1001' is not within 0 to 1000 us (one period of poll_hz)"},
        Mistake{"simulate: true\n    poll_hz: 0\n    phase_us: 10", "",
                "m.yaml:7:15: buses.b0.phase_us: has no meaning without slots: set poll_hz"},
        Mistake{"simulate: true\n    realtime: {priority: 100}", "",
                "m.yaml:6:26: buses.b0.realtime.priority: '100' is not within 0 to 99"},
        Mistake{"simulate: true\n    pol_hz: 10", "",
                "m.yaml:6:5: buses.b0: unknown key 'pol_hz'; did you mean 'poll_hz'?"}));

struct WholeFile {
  const char* text;
  const char* message;
};
class WholeFileTest : public ::testing::TestWithParam<WholeFile> {};

TEST_P(WholeFileTest, NamesPlaceValueAndWhatIsRight) {
  EXPECT_THAT(ErrorsOf(GetParam().text), HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    File, WholeFileTest,
    ::testing::Values(
        WholeFile{"buses: {}\n", "m.yaml:1:1: machine: is missing\n"},
        WholeFile{"machine: a\n", "m.yaml:1:1: buses: is missing or empty: a machine needs at least one bus"},
        WholeFile{"machine: Press 3\n", "m.yaml:1:10: machine: 'Press 3' is no name: 1 to 24 of a-z, 0-9, _ and -"},
        WholeFile{"machine: a\nplotter: {file: x}\n", "m.yaml:2:1: unknown key 'plotter'; known here: bridge, "},
        WholeFile{"- a\n- b\n", "m.yaml:1:1: the file: a list is given where a mapping (key: value) is expected"},
        WholeFile{"just text\n", "m.yaml:1:1: the file: 'just text' is given where a mapping"},
        WholeFile{"machine: a\nbridge: {unsigned_commands: yes}\n",
                  "m.yaml:2:29: bridge.unsigned_commands: 'yes' is not one of allow, refuse"},
        WholeFile{
            "machine: a\nlcm: {url: 'udp://1.2.3.4:7667'}\n",
            "m.yaml:2:12: lcm.url: 'udp://1.2.3.4:7667' is no udpm:// URL, e.g. udpm://239.255.76.67:7667?ttl=0"},
        WholeFile{"machine: a\nlcm: {url: 'udpm://1.2.3.4:7667'}\n", "has no multicast group (224.0.0.0 to"},
        WholeFile{"machine: a\nlcm: {url: 'udpm://239.255.76.67:77777'}\n", "has no port (1 to 65535)"},
        WholeFile{"machine: a\nlcm: {url: 'udpm://239.255.76.67:7667?ttl=256'}\n", "has a bad ttl"},
        WholeFile{"machine: a\nlcm: {command_url: 'udpm://239.255.76.67:7667?ttl=0'}\n",
                  "m.yaml:2:20: lcm.command_url: 'udpm://239.255.76.67:7667?ttl=0' has the port of lcm.url"},
        WholeFile{"machine: a\nlcm: {prefix: 'a b'}\n", "m.yaml:2:15: lcm.prefix: 'a b' is no prefix"},
        WholeFile{"machine: a\nlcm: {interface: 'eth 1'}\n", "m.yaml:2:18: lcm.interface: 'eth 1' is no interface"},
        WholeFile{"machine: a\nlcm: {url: 'udpm://[ff15::4c43]:7667'}\n", "set `lcm: {interface: eth1}`"},
        WholeFile{"machine: a\nlcm: {interface: eth1, url: 'udpm://239.255.76.67:7667?interface=eth2'}\n",
                  "has two interfaces: right is one"},
        WholeFile{"machine: a\nlcm: {interface: eth1, url: 'memq://'}\n",
                  "lcm.interface: has no meaning with memq://"},
        WholeFile{"machine: a\nbuses:\n  B0: {family: point}\n", "m.yaml:3:3: buses.B0: 'B0' is no name"},
        WholeFile{"machine: a\nbuses:\n  b0:\n", "m.yaml:3:3: buses.b0: is empty; a mapping"},
        WholeFile{"machine: a\nbuses:\n  b0: {simulate: true}\n",
                  "m.yaml:3:3: buses.b0.family: is missing: one of point, ring"},
        WholeFile{"machine: a\nbuses:\n  b0: {family: ponit}\n",
                  "m.yaml:3:16: buses.b0.family: 'ponit' is not one of point, ring; did you mean 'point'?"},
        WholeFile{"machine: a\nbuses:\n  b0: {family: point, simulate: true}\n",
                  "m.yaml:3:3: buses.b0.devices: is missing or empty: name at least one device"},
        WholeFile{"machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {a: {}, b: {}}}\n",
                  "m.yaml:3:48: buses.b0.devices: 2 devices, but point is point to point (its protocol has no "
                  "addresses): one device per bus; give 'b' a bus of its own"},
        WholeFile{
            "machine: a\nbuses:\n  b0: {family: ring, simulate: true, poll_hz: 1, devices: {a: {}, b: {}, c: {}, "
            "d: {}, e: {}}}\n",
            "5 devices, but a bus of ring holds at most 4: split the bus"},
        WholeFile{
            "machine: a\nbuses:\n  b0: {family: ring, simulate: true, poll_hz: 30, devices: {a: {}, b: {}, c: {}, "
            "d: {}}}\n",
            "m.yaml:3:47: buses.b0.poll_hz: 30 Hz is more than the wire carries: one round takes 40000 us; at "
            "most 25 Hz, or 0, or split the bus"},
        WholeFile{"machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {a: {}}}\n"
                  "  b1: {family: point, simulate: true, devices: {a: {}}}\n",
                  "m.yaml:4:49: buses.b1.devices.a: the name is taken by a device of bus b0"},
        WholeFile{"machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {a: {}}}\n"
                  "  b0: {family: point, simulate: true, devices: {b: {}}}\n",
                  "m.yaml:4:3: key 'b0' is given twice here; the first is in line 3"},
        WholeFile{"machine: a\nbuses:\n  b0: {family: point, link: {port: /dev/x}, devices: {a: {}}}\n"
                  "  b1: {family: point, link: {port: /dev/x}, devices: {b: {}}}\n",
                  "m.yaml:4:36: buses.b1.link.port: '/dev/x' is used already by bus b0: each bus has a port of its "
                  "own"},
        WholeFile{"machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {Axis: {}}}\n",
                  "m.yaml:3:49: buses.b0.devices.Axis: 'Axis' is no name"},
        WholeFile{
            "machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {bridge: {}}}\n",
            "m.yaml:3:49: buses.b0.devices.bridge: 'bridge' is the bridge's own name (ALARM/bridge): give the "
            "device another one"},
        WholeFile{"machine: a\nbuses:\n  b0: {family: point, simulate: true, devices: {a: 5}}\n",
                  "m.yaml:3:49: buses.b0.devices.a: '5' is given where a mapping (key: value) is expected"}));

// CSI as one character of two bytes, an escape sequence, and a mark that turns the direction of text.
TEST(Mistake, KeysAndValuesCannotControlATerminal) {
  const std::string text = ErrorsOf(
      "machine: a\nbuses:\n  \"b\\e[2J\\u009b3J\\u202e\": {family: point, simulate: true, devices: {a: {unit: "
      "\"\\u2066m\"}}}\n");
  EXPECT_THAT(text, HasSubstr("buses.b\uFFFD[2J\uFFFD3J\uFFFD: "));
  for (const char* bad : {"\x1B", "\xC2\x9B", "\xE2\x80\xAE", "\xE2\x81\xA6"})
    EXPECT_THAT(text, Not(HasSubstr(bad)));
}

}  // namespace
}  // namespace axlecast
