#include "drivers/hal/adapter.h"

#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>

namespace axlecast {
namespace {

constexpr double kTolerance = 0.02;  // of a receiver that samples bit 9 in its middle; the sum of both ends
constexpr double kMinWarning = 0.005;
constexpr std::int64_t kEveryChip = 921'600;

constexpr std::uint16_t kFtdi = 0x0403;
constexpr std::uint16_t kSilabs = 0x10C4;
constexpr std::uint16_t kWch = 0x1A86;

std::string Megabaud(double baud) {
  char text[32];
  std::snprintf(text, sizeof text, "%.4g Mbaud", baud / 1e6);
  return text;
}

struct Chip {
  std::string name;
  double baud = 0;     // the rate it produces if `baud` is requested; 0: unknown
  std::string advice;  // if that rate does not fit
};

// Linux ftdi_sio: clock / n, n in eighths; between 1 and 2 the chips have only 1.5.
double FtdiRate(double clock, double baud) {
  const double eighths = std::round(8 * clock / baud);
  if (eighths >= 16) return clock / (eighths / 8);
  const double rates[] = {clock, clock / 1.5, clock / 2};
  double best = rates[0];
  for (const double rate : rates) {
    if (std::abs(rate - baud) < std::abs(best - baud)) best = rate;
  }
  return best;
}

// FTDI's chips, with bcdDevice as in Linux ftdi_sio (ftdi_determine_type).
struct FtdiChip {
  std::uint16_t release;
  const char* name;
  double clock;
};
constexpr FtdiChip kFtdiChips[] = {{0x0400, "FT232BM", 3e6}, {0x0500, "FT2232C/D", 3e6}, {0x0600, "FT232R", 3e6},
                                   {0x1000, "FT-X", 3e6},    {0x0700, "FT2232H", 12e6},  {0x0800, "FT4232H", 12e6},
                                   {0x0900, "FT232H", 12e6}};

Chip FindChip(const UsbAdapter& adapter, double baud) {
  const char* const advice = "use one with an FT232H";
  if (adapter.vendor == kFtdi) {
    const auto* const chip = std::ranges::find(kFtdiChips, adapter.release, &FtdiChip::release);
    if (chip == std::end(kFtdiChips)) return {};
    return {chip->name, FtdiRate(chip->clock, baud), "use one with an FT232H, FT2232H or FT4232H"};
  }
  if (adapter.vendor == kSilabs && adapter.product == 0xEA60 && baud > 1e6) {
    // The best of them, CP2102N: 48 MHz / (2 n), at most 3 Mbaud (Linux cp210x, Silicon Labs AN205).
    return {"CP2102/CP2104", std::min(24e6 / std::round(24e6 / baud), 3e6), advice};
  }
  if (adapter.vendor == kWch && (adapter.product == 0x7523 || adapter.product == 0x5523)) {
    return {"CH340/CH341", std::min(baud, 2e6), advice};  // WCH's data sheet: 2 Mbaud at most
  }
  return {};
}

std::uint16_t ReadHex(const std::filesystem::path& file) {
  std::ifstream stream(file);
  unsigned value = 0;
  stream >> std::hex >> value;
  return static_cast<std::uint16_t>(value);
}

int ReadNumber(const std::string& file) {
  std::ifstream stream(file);
  int value = -1;
  return stream >> value ? value : -1;
}

}  // namespace

AdapterVerdict CheckAdapter(const UsbAdapter& adapter, std::int64_t baud) {
  const auto wanted = static_cast<double>(baud);
  char id[16];
  std::snprintf(id, sizeof id, "%04x:%04x", unsigned{adapter.vendor}, unsigned{adapter.product});
  const Chip chip = FindChip(adapter, wanted);
  AdapterVerdict verdict;
  verdict.baud = chip.baud;
  if (chip.baud <= 0) {
    if (baud > kEveryChip) {
      verdict.text = std::string("the USB adapter ") + id + " is not known here: make sure that its chip makes " +
                     Megabaud(wanted) + " (FT232H does)";
    }
    return verdict;
  }
  const double deviation = chip.baud / wanted - 1;
  if (std::abs(deviation) < kMinWarning) return verdict;
  char percent[16];
  std::snprintf(percent, sizeof percent, "%+.2f %%", deviation * 100);
  verdict.fits = std::abs(deviation) <= kTolerance;
  verdict.text = "the USB adapter " + std::string(id) + " (" + chip.name + ") makes " + Megabaud(chip.baud) +
                 " of the " + Megabaud(wanted) + " asked for (" + percent + ")";
  verdict.text += verdict.fits ? ", within what a UART takes" : ": it cannot do this rate; " + chip.advice;
  return verdict;
}

TtyFacts ReadTtyFacts(const std::string& sysfs, unsigned major, unsigned minor) {
  TtyFacts facts;
  std::error_code error;
  const std::string number = std::to_string(major) + ':' + std::to_string(minor);
  const auto root = std::filesystem::weakly_canonical(sysfs, error);
  auto directory = std::filesystem::canonical(std::filesystem::path(sysfs) / "dev/char" / number, error);
  if (error) return facts;
  // .../usb1/1-2/1-2:1.0/ttyUSB0/tty/ttyUSB0: the port has the timer, and the USB device above it has the ids.
  for (; directory != root && directory.has_relative_path(); directory = directory.parent_path()) {
    if (facts.latency_timer.empty() && std::filesystem::exists(directory / "latency_timer", error)) {
      facts.latency_timer = directory / "latency_timer";
    }
    if (!std::filesystem::exists(directory / "idVendor", error)) continue;
    facts.usb = UsbAdapter{ReadHex(directory / "idVendor"), ReadHex(directory / "idProduct"),
                           ReadHex(directory / "bcdDevice")};
    break;
  }
  return facts;
}

std::optional<TtyFacts> ReadTtyFacts(const std::string& path) {
  struct stat status {};
  if (stat(path.c_str(), &status) != 0 || !S_ISCHR(status.st_mode)) return std::nullopt;
  return ReadTtyFacts("/sys", major(status.st_rdev), minor(status.st_rdev));
}

int ReadLatency(const std::string& latency_timer) { return latency_timer.empty() ? -1 : ReadNumber(latency_timer); }

Result<> ShortenLatency(const std::string& latency_timer) {
  const int before = ReadNumber(latency_timer);
  if (before == 1) return {};
  std::ofstream(latency_timer) << 1 << std::flush;
  if (ReadNumber(latency_timer) == 1) return {};
  const std::string port = std::filesystem::path(latency_timer).parent_path().filename();
  return Failure("the USB adapter's latency timer is " + std::to_string(before) + " ms: about " +
                 std::to_string(before > 0 ? 1000 / before : 0) +
                 " exchanges a second at most. Set it to 1 ms (as root):\n"
                 "  echo 1 > /sys/bus/usb-serial/devices/" +
                 port +
                 "/latency_timer\n"
                 "and for every time it is plugged in, in /etc/udev/rules.d/99-axlecast.rules:\n"
                 "  ACTION==\"add\", SUBSYSTEM==\"usb-serial\", DRIVER==\"ftdi_sio\", ATTR{latency_timer}=\"1\"");
}

}  // namespace axlecast
