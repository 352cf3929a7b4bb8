#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <utility>

#include "bridge/store/durable_store.h"
#include "core/messages/message.h"

namespace axlecast {

// A process was killed (kill -9): nothing of it runs any more.
struct Killed {};

// Counts the transitions of a process: the instants before and after each thing that it makes durable or sends. Kills
// it at a chosen one: in virtual time by throwing Killed, a real process by whatever `kill` does. Thread-safe.
class Faults {
 public:
  static constexpr std::int64_t kNever = -1;

  Faults() : kill_([] { throw Killed{}; }) {}
  explicit Faults(std::function<void()> kill) : kill_(std::move(kill)) {}

  void KillAt(std::int64_t transition) { kill_at_ = transition; }
  [[nodiscard]] std::int64_t count() const { return count_; }

  void Pass() {
    std::int64_t here = count_++;
    if (kill_at_.compare_exchange_strong(here, kNever)) kill_();
  }

 private:
  std::function<void()> kill_;
  std::atomic<std::int64_t> count_ = 0;
  std::atomic<std::int64_t> kill_at_ = kNever;
};

// What a process sends.
class FaultySink final : public MessageSink {
 public:
  FaultySink(MessageSink& sink, Faults& faults) : sink_(sink), faults_(faults) {}
  void Publish(const std::string& channel, Bytes message) override {
    faults_.Pass();
    sink_.Publish(channel, message);
    faults_.Pass();
  }

 private:
  MessageSink& sink_;
  Faults& faults_;
};

// What the bridge makes durable.
class FaultyStore final : public DurableStore {
 private:
  template <typename Change>
  auto Around(const Change& change) {
    faults_.Pass();
    const auto result = change();
    faults_.Pass();
    return result;
  }

 public:
  FaultyStore(DurableStore& store, Faults& faults) : store_(store), faults_(faults) {}
  FaultyStore(std::unique_ptr<DurableStore> store, Faults& faults)
      : owned_(std::move(store)), store_(*owned_), faults_(faults) {}

  bool Accepted(const CommandRecord& record, Timestamp now) override {
    return Around([&] { return store_.Accepted(record, now); });
  }
  bool Routed(const command_status_t& status, std::int64_t epoch, Timestamp now) override {
    return Around([&] { return store_.Routed(status, epoch, now); });
  }
  void Step(const command_status_t& status, Timestamp now) override {
    Around([&] { return store_.Step(status, now), true; });
  }
  void Outcome(const command_status_t& status, Timestamp now) override {
    Around([&] { return store_.Outcome(status, now), true; });
  }
  bool Apply(const std::string& device, const DeviceChange& change) override {
    return Around([&] { return store_.Apply(device, change); });
  }
  std::vector<AlarmMark> Marks(const std::string& device) const override { return store_.Marks(device); }
  std::int64_t ReserveEpochs(std::int64_t at_least, std::int64_t count) override {
    return Around([&] { return store_.ReserveEpochs(at_least, count); });
  }
  void KeepPosition(const std::string& device, const LastPosition& position) override {
    store_.KeepPosition(device, position);
  }
  void Note(const AxisEvent& event) override { store_.Note(event); }
  void Tick(Timestamp now) override { store_.Tick(now); }
  std::optional<command_status_t> Find(const CommandId& id) const override { return store_.Find(id); }
  AxisRecord Find(const std::string& device) const override { return store_.Find(device); }
  std::vector<DatumRecord> Datums(const std::string& device) const override { return store_.Datums(device); }
  std::vector<OpenCommand> Open() const override { return store_.Open(); }
  bool readable() const override { return store_.readable(); }
  Result<> state() const override { return store_.state(); }

 private:
  const std::unique_ptr<DurableStore> owned_;
  DurableStore& store_;
  Faults& faults_;
};

}  // namespace axlecast
