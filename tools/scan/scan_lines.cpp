#include "tools/scan/scan_lines.h"

#include <filesystem>

#include "drivers/hal/can_socket.h"
#include "drivers/hal/line_guard.h"
#include "drivers/hal/simulated_can.h"
#include "drivers/hal/simulated_spi.h"
#include "drivers/hal/spi_port.h"

namespace axlecast {
namespace {

// Every port supports it. Each trial sets its own format.
constexpr LineFormat kAtFirst = {.baud = 9'600};
constexpr int kMaxReads = 100;  // so that bytes without end do not block a scan

}  // namespace

SerialScanLine::SerialScanLine(const std::string& path, bool echo, const Clock& clock)
    : path_(path),
      port_({.path = path, .format = kAtFirst, .pty = {.foreign = IsPtyByNumber(path)}}, clock),
      transactor_(port_, clock, echo, nullptr) {}

Result<> SerialScanLine::Open() {
  Result<> opened = port_.Open();
  if (opened) return opened;
  const std::string holder = PortHolder(path_);
  if (holder.empty()) return opened;
  return Failure(opened.error().text + " (" + holder + " has it open)");
}

bool SerialScanLine::Set(const ProbeTrial& trial) {
  const bool set = port_.SetFormat(trial.line);
  bool lost = false;
  for (int i = 0; i < kMaxReads && !lost; ++i) {  // received at the previous rate
    const Event* stray = transactor_.FindStray();
    if (stray == nullptr) break;
    lost = stray->kind == Event::Kind::kLinkDown;
  }
  return set || lost;  // the next step reports a lost line
}

Result<> SpiScanLine::OpenWith(const SpiSettings& settings) {
  transactor_.reset();
  link_.reset();  // before the new link takes the lock
  std::error_code ignored;
  if (std::filesystem::is_socket(path_, ignored)) {
    link_ = std::make_unique<SimulatedSpi>(path_, settings, clock_);
  } else {
    link_ = std::make_unique<SpiPort>(path_, settings, clock_);
  }
  transactor_ = std::make_unique<SerialTransactor>(*link_, clock_, false, nullptr);
  return link_->Open();
}

CanScanLine::~CanScanLine() {
  transactor_.reset();
  link_.reset();
  if (!touched_) return;
  // If a setting cannot be restored, the interface shows it: it stays down or in listen-only mode.
  static_cast<void>(netlink_.Switch(found_, false));
  static_cast<void>(netlink_.Configure(found_, found_.bitrate, found_.listen_only));
}

Result<> CanScanLine::Open() {
  if (IsSimulated()) return SimulatedCan(interface_, CanBitrates().front(), clock_).Open();
  if (Result<> opened = netlink_.Open(); !opened) return opened;
  found_ = netlink_.Ask(interface_).value_or(CanInterface());
  if (found_.is_controller && !found_.up) return {};
  // Opening the socket finds other errors, and a driver that uses the interface.
  CanSocket socket({.interface = interface_, .bitrate = 0, .filters = {}}, clock_);
  return socket.Open();
}

bool CanScanLine::MayConfigure() { return IsSimulated() || netlink_.Switch(found_, false) == 0; }

std::string CanScanLine::ListenLine() const {
  return "ip link set " + interface_ + " up type can bitrate BITRATE listen-only on";
}

bool CanScanLine::ListenAt(std::int64_t bitrate) {
  touched_ = true;
  return netlink_.Switch(found_, false) == 0 && netlink_.Configure(found_, bitrate, true) == 0 &&
         netlink_.Switch(found_, true) == 0;
}

bool CanScanLine::Set(const ProbeTrial& trial) {
  if (link_ && (is_up() || trial.bitrate == current_)) return true;
  transactor_.reset();
  link_.reset();
  current_ = trial.bitrate;
  if (IsSimulated()) {
    link_ = std::make_unique<SimulatedCan>(interface_, trial.bitrate, clock_);
  } else {
    if (!is_up() && !ListenAt(trial.bitrate)) return false;
    link_ = std::make_unique<CanSocket>(CanSettings{.interface = interface_, .bitrate = 0, .filters = {}}, clock_);
  }
  transactor_ = std::make_unique<CanTransactor>(*link_, clock_);
  if (link_->Open()) return true;
  link_.reset();
  return false;
}

std::vector<PlannedTrial> AtBitrates(const std::vector<PlannedTrial>& plan,
                                     const std::vector<std::int64_t>& bitrates) {
  std::vector<PlannedTrial> all;
  for (const std::int64_t bitrate : bitrates) {
    for (PlannedTrial planned : plan) {
      planned.trial.bitrate = bitrate;
      all.push_back(std::move(planned));
    }
  }
  return all;
}

const std::vector<std::int64_t>& CanBitrates() {
  static const std::vector<std::int64_t> kBitrates = {500'000, 250'000, 125'000, 1'000'000, 800'000,
                                                      100'000, 50'000,  20'000,  10'000};
  return kBitrates;
}

}  // namespace axlecast
