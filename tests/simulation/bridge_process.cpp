#include "tests/simulation/bridge_process.h"

#include <algorithm>
#include <axlecast/driver_command_t.hpp>
#include <axlecast/driver_order_t.hpp>

#include "core/alarm/alarm_table.h"
#include "core/base/text.h"

namespace axlecast::simulation {

Timestamp BridgeProcess::Now() {
  const MonoNs mono = host_.clock.Now();
  time_.Update(mono, host_.clock.UtcMicroseconds());
  return {mono, time_.Utime(mono)};
}

void BridgeProcess::Start() {
  store_ = std::make_unique<SqliteStore>(disk_.folder() + "/journal.db", machine_.machine);
  if (const Result<> state = store_->state(); !state)
    promises_.Breach("the journal cannot be used: " + state.error().text);
  journal_ = std::make_unique<InlineJournal>(*store_);
  commands_ = std::make_unique<HostPort>(
      network_, host_, Port::kCommands,
      [this](const std::string& channel, Bytes message) { JudgeEpoch(channel, message); });
  data_ = std::make_unique<HostPort>(network_, host_, Port::kData);
  time_ = Timebase();
  dispatcher_ = std::make_unique<Dispatcher>(machine_, host_.NewOrigin(machine_.machine),
                                             BridgePorts{.journal = journal_.get(),
                                                         .commands = commands_.get(),
                                                         .data = data_.get(),
                                                         .key = nullptr,
                                                         .log = [](const std::string&) {},
                                                         .random = [this] { return host_.random.Id(); }},
                                             Now());
  membership_ = network_.Join(host_, Port::kCommands,
                              [this](const std::string& channel, Bytes message) { OnMessage(channel, message); });
  frozen_until_ = 0;
  Tick(++life_);
}

void BridgeProcess::Kill(const CutChoice& choice) {
  if (!dispatcher_) return;
  ++life_;
  former_epoch_ = std::max(former_epoch_, newest_epoch_);
  network_.Leave(membership_);
  disk_.Crash(choice);
  dispatcher_.reset();
  journal_.reset();
  store_.reset();
  inbox_.clear();
  disk_.Sweep();
}

void BridgeProcess::JudgeEpoch(const std::string& channel, Bytes message) {
  if (!channel.starts_with("DRIVER_COMMAND/")) return;
  const auto envelope = DecodeMessage<driver_command_t>(message);
  const auto order = envelope ? DecodeMessage<driver_order_t>(envelope->order) : std::nullopt;
  if (!order) return promises_.Breach("the bridge sent an order that cannot be decoded");
  promises_.Count("orders to drivers");
  newest_epoch_ = std::max(newest_epoch_, order->bridge_epoch);
  if (order->bridge_epoch <= former_epoch_) promises_.Breach("the bridge used an epoch of an earlier one again");
}

void BridgeProcess::StallDisk(bool stalled) {
  if (!journal_) return;
  if (stalled) journal_->Stall();
  if (!stalled) journal_->Recover();
}

void BridgeProcess::JudgeBounds() {
  if (!runs()) return;
  for (const BusConfig& bus : machine_.buses) {
    for (const DeviceConfig& device : bus.devices) {
      const std::vector<AlarmMark> marks = store_->Marks(device.name);
      const auto shelved =
          static_cast<std::size_t>(std::count_if(marks.begin(), marks.end(), [](const AlarmMark& mark) {
            return mark.kind == AlarmMark::Kind::kShelved;
          }));
      promises_.Count("tables of shelved alarms within their bound");
      if (shelved > AlarmShelves::kMax)
        promises_.Breach(Text("%s: %zu alarms are shelved", device.name.c_str(), shelved));
    }
  }
}

bool BridgeProcess::accepts_changes() const {
  return dispatcher_ && dispatcher_->CheckJournal(host_.clock.Now()).has_value();
}

void BridgeProcess::OnMessage(const std::string& channel, Bytes message) {
  if (schedule_.now() >= frozen_until_ && inbox_.empty()) return Handle(channel, message);
  if (inbox_.size() < kInbox)
    inbox_.emplace_back(channel, std::vector<std::uint8_t>(message.begin(), message.end()));
}

void BridgeProcess::Handle(const std::string& channel, Bytes message) {
  if (channel == "COMMAND") return dispatcher_->OnCommand(message, Now());
  if (channel.starts_with("DRIVER_STATUS/")) return dispatcher_->OnDriverStatus(channel, message, Now());
  if (channel == "COMMAND_STATUS") dispatcher_->OnCommandStatus(message, Now());
}

void BridgeProcess::Tick(std::int64_t life) {
  if (life != life_) return;
  if (schedule_.now() < frozen_until_) {
    schedule_.At(frozen_until_, [this, life] { Tick(life); });
    return;
  }
  while (!inbox_.empty()) {
    const auto [channel, message] = std::move(inbox_.front());
    inbox_.pop_front();
    Handle(channel, message);
  }
  dispatcher_->Settle(Now());
  dispatcher_->Tick(Now());
  schedule_.After(kTick + host_.Late(), [this, life] { Tick(life); });
}

}  // namespace axlecast::simulation
