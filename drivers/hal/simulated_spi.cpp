#include "drivers/hal/simulated_spi.h"

#include <poll.h>

#include <array>

#include "platform/os/system_clock.h"

namespace axlecast {
namespace {

constexpr std::string_view kProtocol = "axlecast-spi-1";
constexpr std::size_t kHeader = 6;  // mode, bits per word, clock
constexpr MonoNs kAnswerTime = kSecond;

using Packet = InlineBytes<kHeader + kMaxFrame>;
static_assert(kHeader + kMaxFrame <= kLongestSimulatedPacket);

Packet PacketOf(const SpiTransfer& transfer) {
  Packet packet{static_cast<std::uint8_t>(transfer.settings.mode),
                static_cast<std::uint8_t>(transfer.bits_per_word)};
  for (int shift = 24; shift >= 0; shift -= 8) {
    packet.Append(static_cast<std::uint8_t>(transfer.settings.clock_hz >> shift));
  }
  packet.Append(transfer.tx);
  return packet;
}

SpiTransfer TransferIn(Bytes packet) {
  SpiTransfer transfer{.settings = {.mode = packet[0], .clock_hz = 0}, .bits_per_word = packet[1], .tx = {}};
  for (std::size_t i = 2; i < kHeader; ++i)
    transfer.settings.clock_hz = transfer.settings.clock_hz << 8 | packet[i];
  transfer.tx = packet.subspan(kHeader);
  return transfer;
}

}  // namespace

// ---- the end of the driver ----

Result<> SimulatedSpi::Open() {
  Close();
  Result<> opened = waiter_.CheckReady().and_then([&] { return socket_.Connect(path_, kProtocol, clock_); });
  if (opened) waiter_.Attach(socket_.FileDescriptor());
  return opened;
}

void SimulatedSpi::Close() {
  waiter_.Detach();
  socket_.Close();
  DropBytes();
}

bool SimulatedSpi::Write(Bytes bytes) {
  if (bytes.size() > kMaxFrame) return false;
  const SpiTransfer transfer{.settings = settings_, .tx = bytes};
  if (Transfer(transfer, Fill(bytes.size()))) return true;
  DropBytes();
  return false;
}

bool SimulatedSpi::Transfer(const SpiTransfer& transfer, std::span<std::uint8_t> rx) {
  if (transfer.tx.empty() || transfer.tx.size() > kMaxFrame || rx.size() != transfer.tx.size()) return false;
  if (socket_.Send(PacketOf(transfer)) != FrameLink::SendResult::kQueued) return false;
  pollfd answer{socket_.FileDescriptor(), POLLIN, 0};
  if (PollUntil({&answer, 1}, clock_.Now() + kAnswerTime, clock_) <= 0) return false;
  const ReadResult read = socket_.Receive(rx);
  if (read.status != Status::kOk || read.count != rx.size()) return false;
  const auto clocks = static_cast<std::int64_t>(rx.size()) * 8;
  return PollUntil({}, clock_.Now() + transfer.settings.ClockTime(clocks), clock_) == 0;
}

ByteLink::ReadResult SimulatedSpi::Read(std::span<std::uint8_t> into, MonoNs deadline) {
  if (!IsOpen()) return {Status::kLost, 0};
  if (HasBytes()) return ReadNow(into);
  // A simulator sends only answers: whatever comes now is the end of the connection.
  pollfd end{socket_.FileDescriptor(), POLLIN, 0};
  return {PollUntil({&end, 1}, deadline, clock_) == 0 ? Status::kTimeout : Status::kLost, 0};
}

Link::Status SimulatedSpi::Wait(MonoNs until) {
  if (HasBytes()) return Status::kOk;
  const Status status = waiter_.Wait(until);
  return status == Status::kOk ? Status::kLost : status;  // as in Read
}

// ---- the end of the simulator ----

Result<> SimulatedSpiPort::Plug() { return socket_.Listen(path_, kProtocol); }

void SimulatedSpiPort::Serve() {
  do {
    while (const std::optional<Bytes> packet = socket_.Next()) {
      if (!Take(*packet)) socket_.DropHost();
    }
  } while (socket_.Welcome());
}

bool SimulatedSpiPort::Take(Bytes packet) {
  if (packet.size() <= kHeader || packet.size() > kHeader + kMaxFrame) return false;
  const SpiTransfer transfer = TransferIn(packet);
  std::array<std::uint8_t, kMaxFrame> in{};
  const auto rx = std::span(in).first(transfer.tx.size());
  simulator().OnTransfer(transfer, Now(), rx);
  return socket_.Send(rx);
}

}  // namespace axlecast
