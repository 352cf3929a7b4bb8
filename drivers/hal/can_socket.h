#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "core/base/time.h"
#include "core/device/can.h"
#include "core/device/link.h"
#include "drivers/hal/can_netlink.h"
#include "drivers/hal/line_reader.h"
#include "platform/os/descriptor.h"

namespace axlecast {

// Converts the kernel's timestamps of frames (UNIX time, CLOCK_REALTIME) to CLOCK_MONOTONIC.
//
// Both clocks are read when a frame is read. If UNIX time was stepped since the timestamp, or if there is no timestamp, the
// interval is wide: after the frame before, after the queue was last empty, and before now.
class CanArrival {
 public:
  explicit CanArrival(const Clock& clock) : clock_(clock) {}

  // Call it when the link was opened: nothing arrived before.
  void Start();
  // Call it when no frame waits.
  void Empty() { empty_ = clock_.Now(); }
  // Returns the arrival time of the next frame, in the order of arrival. `stamp`: ns UNIX, or nothing without a timestamp.
  [[nodiscard]] Interval At(std::optional<std::int64_t> stamp);

 private:
  // CLOCK_REALTIME - CLOCK_MONOTONIC is between these; ns.
  struct Offset {
    std::int64_t minimum = 0;
    std::int64_t maximum = 0;
    MonoNs now = 0;  // when it was read
  };
  [[nodiscard]] Offset Read() const;

  const Clock& clock_;
  Offset before_;     // at the frame before
  MonoNs floor_ = 0;  // later frames did not arrive before it
  MonoNs empty_ = 0;  // the queue was empty; a timestamp may be some us older
};

// Adds the content of an error frame of Linux (linux/can/error.h) to `controller`: bus-offs, restarts, protocol errors, missing
// acknowledges, overflows, and the error counters if the frame contains them. Ignores a frame without kCanError. The content
// depends on the driver of the controller: some report bit errors and missing acknowledges only after `ip link set can0 type
// can berr-reporting on`.
void CountCanError(const CanFrame& frame, CanController& controller);

struct CanSettings {
  std::string interface;     // can0
  std::int64_t bitrate = 0;  // required bit rate, if the interface reports it; 0: any
  CanFilters filters;        // frames to receive; none: all
  bool sole = true;          // lock the interface against a second driver; simulators do not
};

// A CAN interface of Linux (SocketCAN). Other programs may use it at the same time, except a second driver. A driver may not
// change the settings of the interface, so Open checks them, and its error contains what the operator must type. Used by one
// thread, except Wake.
//
// Receive returns frames that pass the filters, all error frames, and own frames when a node has acknowledged them.
//
// A frame that no node acknowledges is not lost: the controller repeats it until a node does, even if this link or its process
// has ended. A command to set zero may therefore be executed minutes later, when the cable is plugged in. Only these drop it:
//  - the interface is set down (`ip link set can0 down`, as root);
//  - a bus-off, which drops the queues, and what is sent until the restart. A missing acknowledge alone never leads to a
//    bus-off (ISO 11898-1: the counter stays at 128);
//  - `ip link set can0 type can one-shot on`, set before: each frame is sent once, so a frame that loses arbitration is
//    dropped too.
// Therefore: send a frame that changes a device only if a node was received just before, and assume that it can still be
// executed until it is confirmed. Controller().pending is the number of such frames.
//
// The driver of the interface reports the acknowledge. Some adapters (serial ones with slcan) report it as soon as they have
// accepted the frame. Then only an answer of the device is a confirmation.
class CanSocket final : public FrameLink {
 public:
  CanSocket(CanSettings settings, const Clock& clock);

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return waiter_.IsAttached(); }
  // Readable when Receive has a frame; -1: closed.
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }
  [[nodiscard]] SendResult Send(const CanFrame& frame) override;
  [[nodiscard]] Status Receive(Received& received) override;
  [[nodiscard]] Status Wait(MonoNs until) override { return waiter_.Wait(until); }
  void Wake() override { waiter_.Wake(); }
  // All values are unknown if the link is closed.
  [[nodiscard]] CanController Controller() override;
  [[nodiscard]] LineErrors Errors() const override {
    return {.framing = counts_.bus_errors, .dropped = counts_.dropped + counts_.overruns};
  }

  // Warnings of the last successful Open, each with its remedy.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  [[nodiscard]] Result<> SetUp();
  [[nodiscard]] Result<> CheckInterface(const CanInterface& interface);
  [[nodiscard]] Result<> Claim();
  [[nodiscard]] Result<> Configure();
  [[nodiscard]] bool ApplyFilters();
  void MakeRoom();
  [[nodiscard]] bool ReceiveOwn(std::uint32_t id);
  [[nodiscard]] bool IsSelected(std::uint32_t id) const;
  void Account(const Received& received);

  CanSettings settings_;
  LineReader waiter_;
  CanArrival arrival_;
  CanNetlink netlink_;
  Descriptor lock_;
  Descriptor socket_;
  std::vector<std::uint32_t> own_ids_;  // sent so far: the filters of the kernel pass them
  bool one_shot_ = false;
  CanController counts_;          // since Open; the other values are queried
  std::uint32_t drops_seen_ = 0;  // counter of the kernel, modulo 2^32
  std::vector<std::string> warnings_;
};

}  // namespace axlecast
