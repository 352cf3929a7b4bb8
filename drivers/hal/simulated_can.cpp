#include "drivers/hal/simulated_can.h"

#include <algorithm>
#include <array>
#include <vector>

namespace axlecast {
namespace {

constexpr std::string_view kProtocol = "axlecast-can-1";
constexpr char kBitrate = 'B';
constexpr char kFrame = 'F';
constexpr char kAcknowledged = 'A';
constexpr char kUnacknowledged = 'N';

constexpr MonoNs kSendAgain = kMillisecond;  // a controller repeats at once; a simulator also serves other buses

constexpr std::size_t kQueue = 11;  // the frame in the controller, and ten in the interface's queue

// ISO 11898-1 12.1.4: the error counter of a transmitter whose frames are not acknowledged stays at 128.
constexpr int kWarning = 96;
constexpr int kPassive = 128;

using Packet = InlineBytes<1 + 4 + kMaxCanData>;

Packet PacketOf(char kind, Bytes content) {
  Packet packet{static_cast<std::uint8_t>(kind)};
  packet.Append(content);
  return packet;
}

Packet BitratePacket(std::int64_t bitrate) {
  Packet packet{static_cast<std::uint8_t>(kBitrate)};
  for (int shift = 24; shift >= 0; shift -= 8) packet.Append(static_cast<std::uint8_t>(bitrate >> shift));
  return packet;
}

CanController::State StateOf(int tec) {
  if (tec >= kPassive) return CanController::State::kPassive;
  return tec >= kWarning ? CanController::State::kWarning : CanController::State::kActive;
}

}  // namespace

// ---- the end of the driver ----

Result<> SimulatedCan::Open() {
  Close();
  Result<> opened = reader_.CheckReady().and_then([&] { return socket_.Connect(path_, kProtocol, clock_); });
  if (!opened) return opened;
  if (socket_.Send(BitratePacket(bitrate_)) != SendResult::kQueued) {
    Close();
    return Failure(path_ + ": the simulator has gone");
  }
  controller_ = {};
  controller_.state = CanController::State::kActive;
  controller_.tec = controller_.rec = 0;
  controller_.bitrate = bitrate_;
  reader_.Attach(socket_.FileDescriptor());
  return {};
}

void SimulatedCan::Close() {
  reader_.Detach();
  socket_.Close();
}

FrameLink::SendResult SimulatedCan::Send(const CanFrame& frame) {
  const SendResult result = socket_.Send(PacketOf(kFrame, ToPacket(frame)));
  if (result == SendResult::kQueued) ++controller_.pending;
  if (result == SendResult::kFull) ++controller_.queue_full;
  return result;
}

Link::Status SimulatedCan::Receive(Received& received) {
  while (true) {
    std::array<std::uint8_t, 1 + 4 + kMaxCanData> packet{};
    const ByteLink::ReadResult read = socket_.Receive(packet);
    if (read.status != Status::kOk) return read.status;
    const std::optional<CanFrame> frame = FromPacket(Bytes(packet).first(read.count).subspan(1));
    const bool own = packet[0] == kAcknowledged;
    const bool unacknowledged = packet[0] == kUnacknowledged;
    if (!frame || (packet[0] != kFrame && !own && !unacknowledged)) return Status::kLost;
    if (own || unacknowledged) Count(own);
    if (unacknowledged) continue;
    const MonoNs now = clock_.Now();
    received = {.frame = *frame, .at = {now, now}, .own = own};
    return Status::kOk;
  }
}

void SimulatedCan::Count(bool acknowledged) {
  if (acknowledged && controller_.pending > 0) --controller_.pending;
  if (!acknowledged) ++controller_.unacknowledged;
  controller_.tec = acknowledged ? std::max(0, controller_.tec - 1) : kPassive;
  controller_.state = StateOf(controller_.tec);
}

// ---- the end of the simulator ----

Result<> SimulatedCanPort::Plug() {
  Unplug();
  return socket_.Listen(path_, kProtocol);
}

void SimulatedCanPort::Unplug() {
  socket_.Close();
  bitrate_ = 0;
  waiting_.clear();
  again_at_ = kNever;
}

void SimulatedCanPort::Serve() {
  if (again_at_ <= Now()) SendWaiting();
  do {
    ReceiveAll();
  } while (socket_.Welcome());
}

void SimulatedCanPort::ReceiveAll() {
  UpdateReceiving();
  while (const std::optional<Bytes> packet = socket_.Next()) {
    if (!Take(*packet)) socket_.DropHost();
  }
  if (socket_.HasHost()) return;
  bitrate_ = 0;
  for (Waiting& waiting : waiting_) waiting.own = false;
}

bool SimulatedCanPort::Take(Bytes packet) {
  const Bytes content = packet.subspan(1);
  if (bitrate_ == 0) {
    if (packet[0] != kBitrate || content.size() != 4) return false;
    for (const std::uint8_t byte : content) bitrate_ = bitrate_ << 8 | byte;
    PassBaud();
    return bitrate_ != 0;
  }
  const std::optional<CanFrame> frame = FromPacket(content);
  if (packet[0] != kFrame || !frame) return false;
  // Only frames of hosts that have ended can fill it. A real queue would not have accepted the frame.
  if (waiting_.size() >= kQueue) return true;
  waiting_.push_back({.frame = *frame});
  if (waiting_.size() == 1) {
    SendWaiting();
  } else {
    UpdateReceiving();
  }
  return true;
}

void SimulatedCanPort::SendWaiting() {
  while (!waiting_.empty() && Send(waiting_.front())) waiting_.pop_front();
  again_at_ = waiting_.empty() ? kNever : Now() + kSendAgain;
  UpdateReceiving();
}

// While a frame waits, further frames of the present host stay in its socket. The frames of a host that has ended wait here.
void SimulatedCanPort::UpdateReceiving() {
  const bool host_waits = !waiting_.empty() && bitrate_ != 0;
  socket_.SetReceiving(!host_waits || socket_.HostHasGone());
}

bool SimulatedCanPort::Send(Waiting& waiting) {
  std::vector<CanPacket> answers;  // sent after the frame that they answer
  const auto answer = [&answers](Bytes bytes) { answers.emplace_back(bytes); };
  const bool acknowledged = simulator().OnFrame(waiting.frame, Now(), answer);
  if (acknowledged) {
    SendToHost(waiting.own ? kAcknowledged : kFrame, ToPacket(waiting.frame));
  } else if (waiting.own && !waiting.tried) {
    SendToHost(kUnacknowledged, ToPacket(waiting.frame));
  }
  waiting.tried = true;
  for (const CanPacket& packet : answers) SendToHost(kFrame, packet);
  return acknowledged;
}

void SimulatedCanPort::Transmit(Bytes bytes) { SendToHost(kFrame, bytes); }

void SimulatedCanPort::SendToHost(char kind, Bytes frame) {
  // Lost if the host does not read.
  if (HasHost()) static_cast<void>(socket_.Send(PacketOf(kind, frame)));
}

}  // namespace axlecast
