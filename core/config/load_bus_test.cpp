#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/config/load.h"
#include "core/config/yaml_text.h"

namespace axlecast {
namespace {

using ::testing::HasSubstr;

struct Read {
  LinkConfig link;
  std::string errors;
};

Read ReadLink(LinkKind kind, const std::string& text, bool simulate = false) {
  const Family family{.name = "some",
                      .summary = "",
                      .link = kind,
                      .default_line = {.baud = 9'600, .parity = Parity::kEven},
                      .default_bitrate = 250'000,
                      .operations = {}};
  ConfigErrors errors("m.yaml");
  const YAML::Node node = ParseYaml(text, errors);
  const LinkConfig link = LoadLink(ConfigMap(node, "buses.b0.link", errors), family, simulate, "/run/press3/b0");
  return {link, errors.Text()};
}

TEST(LoadLink, ASerialLineHasAPortAndAFormat) {
  const Read read = ReadLink(LinkKind::kSerial, "{port: /dev/ttyUSB0, baud: 19200, parity: none}");
  EXPECT_EQ(read.errors, "");
  EXPECT_EQ(read.link.port, "/dev/ttyUSB0");
  EXPECT_EQ(read.link.line.baud, 19'200);
  EXPECT_EQ(read.link.line.parity, Parity::kNone);
  EXPECT_FALSE(read.link.pty);
  EXPECT_TRUE(ReadLink(LinkKind::kSerial, "{port: /dev/pts/3, pty: true}").link.pty);
}

TEST(LoadLink, ACanBusHasAnInterfaceAndABitrate) {
  const Read usual = ReadLink(LinkKind::kCan, "{iface: can0}");
  EXPECT_EQ(usual.errors, "");
  EXPECT_EQ(usual.link.port, "can0");
  EXPECT_EQ(usual.link.bitrate, 250'000);
  EXPECT_EQ(ReadLink(LinkKind::kCan, "{iface: can0, bitrate: 1000000}").link.bitrate, 1'000'000);
}

TEST(LoadLink, AnSpiBusHasADeviceAndAClock) {
  const Read usual = ReadLink(LinkKind::kSpi, "{spidev: /dev/spidev0.1}");
  EXPECT_EQ(usual.errors, "");
  EXPECT_EQ(usual.link.port, "/dev/spidev0.1");
  EXPECT_EQ(usual.link.clock_hz, 0);
  EXPECT_EQ(ReadLink(LinkKind::kSpi, "{spidev: /dev/spidev0.1, clock_hz: 150000}").link.clock_hz, 150'000);
}

TEST(LoadLink, ASimulatedBusStandsInTheRunDirectory) {
  EXPECT_EQ(ReadLink(LinkKind::kModbus, "{}", true).link.port, "/run/press3/b0.pty");
  EXPECT_EQ(ReadLink(LinkKind::kCan, "{iface: can0}", true).link.port, "/run/press3/b0.can");
  EXPECT_EQ(ReadLink(LinkKind::kSpi, "{spidev: /dev/spidev0.0}", true).link.port, "/run/press3/b0.spi");
}

TEST(LoadLink, EveryMistakeNamesWhatWouldBeRight) {
  const auto errors = [](LinkKind kind, const char* text) { return ReadLink(kind, text).errors; };
  EXPECT_THAT(errors(LinkKind::kSerial, "{}"), HasSubstr("link.port: is missing: name the serial port"));
  EXPECT_THAT(errors(LinkKind::kCan, "{}"), HasSubstr("link.iface: is missing: name the CAN interface (ip -brief"));
  EXPECT_THAT(errors(LinkKind::kSpi, "{}"), HasSubstr("link.spidev: is missing: name the SPI device (ls /dev/sp"));
  EXPECT_THAT(errors(LinkKind::kCan, "{iface: /dev/can0}"),
              HasSubstr("'/dev/can0' is no name of an interface, e.g. can0"));
  EXPECT_THAT(errors(LinkKind::kCan, "{iface: a_name_of_16_cha}"), HasSubstr("is no name of an interface"));
  EXPECT_THAT(errors(LinkKind::kSpi, "{spidev: spidev0.0}"),
              HasSubstr("'spidev0.0' is no absolute path, e.g. /dev/spidev0.0"));
  EXPECT_THAT(errors(LinkKind::kCan, "{iface: can0, bitrate: 2000000}"), HasSubstr("10000 to 1000000 bit/s"));
  EXPECT_THAT(errors(LinkKind::kSpi, "{spidev: /dev/spidev0.0, clock_hz: -1}"), HasSubstr("link.clock_hz: '-1'"));
}

TEST(LoadLink, KeysOfAnotherKindOfLineAreUnknown) {
  EXPECT_THAT(ReadLink(LinkKind::kCan, "{iface: can0, baud: 9600}").errors, HasSubstr("unknown key 'baud'"));
  EXPECT_THAT(ReadLink(LinkKind::kSpi, "{spidev: /dev/spidev0.0, parity: even}").errors,
              HasSubstr("unknown key 'parity'"));
  EXPECT_THAT(ReadLink(LinkKind::kSerial, "{port: /dev/ttyUSB0, bitrate: 250000}").errors,
              HasSubstr("unknown key 'bitrate'"));
}

}  // namespace

}  // namespace axlecast
