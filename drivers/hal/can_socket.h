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

// When frames arrived, on CLOCK_MONOTONIC, from the UNIX time (CLOCK_REALTIME) at which the kernel stamped them.
//
// Both clocks are read when a frame is handed over. Between the stamp and that, UNIX time may have been stepped: then,
// and where the kernel gave no stamp, all that is said of a frame is that it came after the one before it, after the
// queue was last empty, and before now.
class CanArrival {
 public:
  explicit CanArrival(const Clock& clock) : clock_(clock) {}

  // The link was opened: nothing arrived before.
  void Start();
  // Nothing waits to be handed over.
  void Empty() { empty_ = clock_.Now(); }
  // Of frames in the order of their arrival. `stamp`: ns UNIX, nothing when the kernel gave none.
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
  MonoNs floor_ = 0;  // no frame to come has arrived before it
  MonoNs empty_ = 0;  // nor was in the queue; its stamp may be some us older
};

// Adds to `controller` what one error frame of Linux (linux/can/error.h) reports: bus-offs, restarts, errors of the
// protocol, missing acknowledges, frames without room, and the error counters where the frame holds them. Touches nothing for a
// frame without kCanError. What a frame holds depends on the controller's driver: bit errors and missing acknowledges
// come only from those that report them, some after `ip link set can0 type can berr-reporting on`.
void CountCanError(const CanFrame& frame, CanController& controller);

struct CanSettings {
  std::string interface;     // can0
  std::int64_t bitrate = 0;  // what it must run at, where it tells; 0: anything
  CanFilters filters;        // what to hear; none: everything
  bool sole = true;          // keeps a second one of ours off the interface; simulators go beside a driver
};

// A CAN interface of Linux (SocketCAN). Any number of other programs may listen to it and send on it meanwhile; a
// second driver may not. The bus's settings are the interface's: setting them needs rights that a driver has not, so
// Open checks them and says what the operator must type. One thread uses it; Wake may be called from any.
//
// Receive hands over what passes the filters, every error frame, and own frames once some node has acknowledged them.
//
// A frame that nobody acknowledges is not lost: the controller repeats it until somebody does, also when this link, or
// its process, is gone. So an order to zero that is queued now may be carried out minutes later, when the cable is
// plugged in. No right of ours can take it back; only these do:
//  - the interface goes down (`ip link set can0 down`, as root): all that is queued is dropped;
//  - a bus-off: the controller's and the interface's queue are dropped, and what is sent until the restart as well.
//    But the missing acknowledge alone never leads to a bus-off (ISO 11898-1: the counter stays at 128);
//  - `ip link set can0 type can one-shot on`, beforehand: each frame is tried once, so one that loses arbitration is
//    dropped too.
// So: send what changes a device only when a node has just been heard, and as long as it is not confirmed hold it for
// still possible. Controller().pending says how many there are.
//
// "Acknowledged" is what the interface's driver says of it. Some adapters (serial ones at slcan) say so as soon as they
// have taken the frame; of them only the device's own answer tells.
class CanSocket final : public FrameLink {
 public:
  CanSocket(CanSettings settings, const Clock& clock);
  ~CanSocket() override;
  CanSocket(const CanSocket&) = delete;
  CanSocket& operator=(const CanSocket&) = delete;

  [[nodiscard]] Result<> Open() override;
  void Close() override;
  [[nodiscard]] bool IsOpen() const override { return waiter_.IsAttached(); }
  // Readable when Receive has something; -1: closed.
  [[nodiscard]] int FileDescriptor() const { return socket_.get(); }
  [[nodiscard]] SendResult Send(const CanFrame& frame) override;
  [[nodiscard]] Status Receive(Received& received) override;
  [[nodiscard]] Status Wait(MonoNs until) override { return waiter_.Wait(until); }
  void Wake() override { waiter_.Wake(); }
  // Of a closed link nothing is known.
  [[nodiscard]] CanController Controller() override;
  [[nodiscard]] LineErrors Errors() const override {
    return {.framing = counts_.bus_errors, .dropped = counts_.dropped + counts_.overruns};
  }

  // What the last successful Open found wanting, each with its remedy.
  [[nodiscard]] const std::vector<std::string>& warnings() const { return warnings_; }

 private:
  [[nodiscard]] Result<> SetUp();
  [[nodiscard]] Result<> CheckInterface(const CanInterface& interface);
  [[nodiscard]] Result<> Claim();
  [[nodiscard]] Result<> Configure();
  [[nodiscard]] bool ApplyFilters();
  void MakeRoom();
  [[nodiscard]] bool HearOwn(std::uint32_t id);
  [[nodiscard]] bool Wanted(std::uint32_t id) const;
  void Account(const Received& received);

  CanSettings settings_;
  LineReader waiter_;
  CanArrival arrival_;
  CanNetlink netlink_;
  Descriptor lock_;
  Descriptor socket_;
  std::vector<std::uint32_t> own_ids_;  // sent so far: the kernel's filters let them come back
  bool one_shot_ = false;
  CanController counts_;          // since Open; the rest of it is asked for
  std::uint32_t drops_seen_ = 0;  // as the kernel counts, modulo 2^32
  std::vector<std::string> warnings_;
};

}  // namespace axlecast
