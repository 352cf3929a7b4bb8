#include "core/config/load_link.h"

#include "core/base/words.h"

namespace axlecast {
namespace {

constexpr std::int64_t kSlowestBaud = 1'200;
constexpr std::int64_t kFastestBaud = 12'000'000;
constexpr std::int64_t kSlowestBitrate = 10'000;  // CiA 301's slowest; classical CAN ends at 1 Mbit/s
constexpr std::int64_t kFastestBitrate = 1'000'000;
constexpr std::int64_t kFastestClock = 50'000'000;
constexpr std::size_t kLongestInterface = 15;  // IFNAMSIZ without its NUL

const char* SuffixOf(LinkKind kind) {
  switch (kind) {
    case LinkKind::kCan:
      return ".can";
    case LinkKind::kSpi:
      return ".spi";
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return ".pty";
}

const char* MissingText(LinkKind kind) {
  switch (kind) {
    case LinkKind::kCan:
      return "is missing: name the CAN interface (ip -brief link show type can), or set simulate: true";
    case LinkKind::kSpi:
      return "is missing: name the SPI device (ls /dev/spidev*), or set simulate: true";
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return "is missing: name the serial port, best by its lasting name (ls -l /dev/serial/by-id/), "
         "or set simulate: true";
}

bool IsInterface(std::string_view name) {
  return name.size() <= kLongestInterface && name.find_first_of("/ \t:") == std::string_view::npos;
}

void CheckName(ConfigMap& map, LinkKind kind, const std::string& name) {
  if (name.empty()) return map.Error(LinkKey(kind), MissingText(kind));
  if (kind == LinkKind::kCan) {
    if (!IsInterface(name)) map.Error("iface", Quoted(name) + " is no name of an interface, e.g. can0");
  } else if (!name.starts_with('/')) {
    const char* example = kind == LinkKind::kSpi ? "/dev/spidev0.0" : "/dev/ttyUSB0";
    map.Error(LinkKey(kind), Quoted(name) + " is no absolute path, e.g. " + example);
  }
}

void LoadLine(ConfigMap& map, const LineFormat& usual, LinkConfig& link) {
  link.line.baud = map.Integer("baud", usual.baud, kSlowestBaud, kFastestBaud, "baud");
  link.line.parity =
      static_cast<Parity>(map.Choice("parity", {"none", "even", "odd"}, static_cast<std::size_t>(usual.parity)));
  link.line.stop_bits = static_cast<int>(map.Integer("stop_bits", usual.stop_bits, 1, 2, "stop bits"));
  link.echo = map.Bool("echo", false);
  link.pty = map.Bool("pty", false);
}

}  // namespace

const char* LinkKey(LinkKind kind) {
  switch (kind) {
    case LinkKind::kCan:
      return "iface";
    case LinkKind::kSpi:
      return "spidev";
    case LinkKind::kSerial:
    case LinkKind::kModbus:
      break;
  }
  return "port";
}

LinkConfig LoadLink(ConfigMap map, const Family& family, bool simulate, const std::string& place) {
  LinkConfig link;
  link.port = map.String(LinkKey(family.link), "");
  if (family.link == LinkKind::kCan) {
    link.bitrate = map.Integer("bitrate", family.default_bitrate, kSlowestBitrate, kFastestBitrate, "bit/s");
  } else if (family.link == LinkKind::kSpi) {
    link.clock_hz = map.Integer("clock_hz", 0, 0, kFastestClock, "Hz (0: as device and cable allow)");
  } else {
    LoadLine(map, family.default_line, link);
  }
  if (simulate) {
    link.port = place + SuffixOf(family.link);
  } else {
    CheckName(map, family.link, link.port);
  }
  map.Done();
  return link;
}

}  // namespace axlecast
