#pragma once

#include <memory>
#include <string>
#include <vector>

#include "drivers/hal/can_netlink.h"
#include "drivers/runtime/bus/transactor.h"
#include "tools/scan/scan.h"

namespace axlecast {

// A CAN interface under a scan, which sends nothing on it. One that is up stays as it is. One that is down is set to each
// bit rate in turn, listening only, and set down and back at the end. The socket of a simulated bus is as one that is down.
class CanScanLine final : public ScanLine {
 public:
  CanScanLine(std::string interface, const Clock& clock) : interface_(std::move(interface)), clock_(clock) {}
  ~CanScanLine() override;
  CanScanLine(const CanScanLine&) = delete;
  CanScanLine& operator=(const CanScanLine&) = delete;

  // Empty, or the cause and the remedy.
  [[nodiscard]] std::string Open();
  [[nodiscard]] bool is_up() const { return found_.up; }
  [[nodiscard]] std::int64_t bitrate() const { return found_.bitrate; }  // 0: not told
  // Whether this process may set a bit rate: asked of the kernel, which changes nothing.
  [[nodiscard]] bool MayConfigure();
  // What to type, as root, so that it listens.
  [[nodiscard]] std::string ListenLine() const;

  [[nodiscard]] bool Set(const ProbeTrial& trial) override;
  [[nodiscard]] Transactor& medium() override { return *medium_; }

 private:
  [[nodiscard]] bool IsSimulated() const { return interface_.starts_with('/'); }
  [[nodiscard]] bool ListenAt(std::int64_t bitrate);

  const std::string interface_;
  const Clock& clock_;
  CanNetlink netlink_;
  CanInterface found_;        // as it was before
  bool touched_ = false;      // its settings are no longer those
  std::int64_t current_ = 0;  // that the socket is open at
  std::unique_ptr<FrameLink> link_;
  std::unique_ptr<CanTransactor> medium_;
};

// The trials at each of these rates, the first rate first.
[[nodiscard]] std::vector<PlannedTrial> AtBitrates(const std::vector<PlannedTrial>& plan,
                                                   const std::vector<std::int64_t>& bitrates);

// Those that CiA 301 names, the usual ones first.
[[nodiscard]] const std::vector<std::int64_t>& CanBitrates();

}  // namespace axlecast
