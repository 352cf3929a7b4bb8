#include "tools/fleet/row_composer.h"

#include <algorithm>
#include <array>
#include <deque>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <tuple>
#include <unordered_map>
#include <utility>
#include <vector>

#include "core/messages/message.h"
#include "core/messages/origin.h"
#include "tools/fleet/alarm_changes.h"
#include "tools/fleet/event_rows.h"
#include "tools/fleet/position_rows.h"
#include "tools/fleet/raw_records.h"
#include "tools/fleet/received_runs.h"

namespace axlecast {
namespace {

// What became of an event.
enum class Fate : std::uint8_t {
  kStored,
  kRepeated,
  kExcluded,
  kOdd,
  kPosition,  // PositionRows counts it
};

// Senders can invent any number of channels: those without rows are looked up again beyond this number.
constexpr std::size_t kMaxKnownChannels = 10'000;

}  // namespace

class RowComposer::Work {
  using Kind = ChannelKind;

 public:
  Work(LogFacts facts, std::string log, DetailRules detail, UtimeRange range)
      : machine_id_(NameHash(facts.machine)),
        chooser_(facts, std::move(log), std::move(detail)),
        devices_(std::move(facts.devices)),
        range_(range) {}

  void SetRange(UtimeRange range) { range_ = range; }

  void Prime(const LogEvent& event) {
    if (IsLogChannel(event.channel)) return;
    Channel& channel = ChannelOf(event.channel);
    BatchRows kept = std::exchange(batch_, {});
    priming_ = true;
    if (channel.MakesRows()) Handle(channel, event);
    priming_ = false;
    channel.received.End(batch_.received);
    batch_ = std::move(kept);
  }

  void Add(const LogEvent& event) {
    if (IsLogChannel(event.channel)) {
      ++batch_.counts.bookkeeping;
      if (event.channel == kMachineChannel) {
        batch_.machine_files.push_back(MachineFileRowOf(event.data, InRange(event.utime)));
      }
      return;
    }
    Channel& channel = ChannelOf(event.channel);
    Fate fate = Fate::kExcluded;
    if (channel.MakesRows()) fate = Handle(channel, event);
    if (channel.choice.detail.raw) {
      raw_.Add(event);
      ++batch_.raw_events;
      if (fate == Fate::kExcluded) fate = Fate::kStored;
    }
    Count(fate);
  }

  void EndStretch() {
    if (raw_.empty()) return;
    RawRow& row = batch_.raw.emplace_back(raw_.Take());
    row.t0 = InRange(row.t0);
    row.t1 = std::max(row.t0, InRange(row.t1));
  }

  BatchRows Take() {
    EndStretch();
    for (Channel* channel : with_positions_) channel->positions->End(batch_);
    with_positions_.clear();
    for (auto& [name, channel] : channels_) channel.received.End(batch_.received);
    JoinRollUps(batch_.seconds);
    JoinRollUps(batch_.minutes);
    for (const PositionChunkRow& chunk : batch_.chunks) batch_.samples += chunk.summary.n;
    return std::exchange(batch_, {});
  }

 private:
  [[nodiscard]] std::int64_t InRange(std::int64_t utime) const {
    return std::clamp(utime, range_.first, range_.end - 1);
  }

  // The newest keys of what must not be stored twice.
  template <typename Key>
  class RecentKeys {
   public:
    // Returns false for a key that is among the newest.
    bool IsNew(const Key& key) {
      constexpr std::size_t kMax = 4'096;
      if (!keys_.insert(key).second) return false;
      order_.push_back(key);
      if (order_.size() > kMax) {
        keys_.erase(order_.front());
        order_.pop_front();
      }
      return true;
    }

   private:
    std::set<Key> keys_;
    std::deque<Key> order_;
  };

  // Selects the messages of a health channel that make rows.
  class HealthPace {
   public:
    bool IsDue(std::int64_t utime, std::string state) {
      constexpr std::int64_t kPeriod = 10'000'000;  // us
      const std::int64_t slot = utime / kPeriod;
      if (slot_ == slot && state_ == state) return false;
      slot_ = slot;
      state_ = std::move(state);
      return true;
    }

   private:
    std::optional<std::int64_t> slot_;
    std::string state_;
  };

  struct TextHash {
    using is_transparent = void;
    std::size_t operator()(std::string_view text) const { return std::hash<std::string_view>()(text); }
  };

  // One channel of the log, with its state.
  struct Channel {
    ChannelChoice choice = {};
    SeqWindow window = {};
    std::optional<PositionRows> positions = {};
    std::optional<AlarmChanges> alarms = {};
    HealthPace health = {};
    ReceivedRuns received = ReceivedRuns("");

    [[nodiscard]] bool MakesRows() const { return choice.detail.detail != Detail::kNone; }
  };

  Channel Make(std::string_view full_name) {
    Channel channel{.choice = chooser_.Of(full_name), .received = ReceivedRuns(CleanText(full_name))};
    const ChannelChoice& choice = channel.choice;
    if (choice.kind == Kind::kPosition || choice.kind == Kind::kPositionBlock) {
      channel.positions.emplace(CleanText(choice.name), ScaleOf(choice.name), choice.detail);
    }
    if (choice.kind == Kind::kAlarm) channel.alarms.emplace(CleanText(choice.name));
    return channel;
  }

  [[nodiscard]] std::optional<AxisScale> ScaleOf(const std::string& device) const {
    const auto facts = devices_.find(device);
    if (facts == devices_.end()) return std::nullopt;
    return AxisScale{.counts_per_turn = facts->second.counts_per_turn,
                     .unit = facts->second.unit,
                     .unit_per_count = facts->second.unit_per_count};
  }

  Channel& ChannelOf(std::string_view name) {
    if (const auto known = channels_.find(name); known != channels_.end()) return known->second;
    Channel channel = Make(name);
    if (!channel.MakesRows() && channels_.size() >= kMaxKnownChannels) return unknown_ = std::move(channel);
    return channels_.emplace(name, std::move(channel)).first->second;
  }

  void Count(Fate fate) {
    switch (fate) {
      case Fate::kStored:
        ++batch_.counts.stored;
        break;
      case Fate::kRepeated:
        ++batch_.counts.repeated;
        break;
      case Fate::kExcluded:
        ++batch_.counts.excluded;
        break;
      case Fate::kOdd:
        ++batch_.counts.odd;
        break;
      case Fate::kPosition:
        break;
    }
  }

  Fate Handle(Channel& channel, const LogEvent& event) {
    switch (channel.choice.kind) {
      case Kind::kOther:
        break;
      case Kind::kPosition:
        return Decoded<position_t>(channel, event,
                                   [&](const position_t& message) { return Position(channel, event, message); });
      case Kind::kPositionBlock:
        return Decoded<position_block_t>(
            channel, event, [&](const position_block_t& message) { return Block(channel, event, message); });
      case Kind::kAlarm:
        return Decoded<alarm_t>(channel, event,
                                [&](const alarm_t& message) { return Alarm(channel, event, message); });
      case Kind::kTrip:
        return Decoded<trip_log_t>(channel, event,
                                   [&](const trip_log_t& message) { return Trip(channel, event, message); });
      case Kind::kDevice:
        return Health<device_info_t>(channel, event, batch_.devices);
      case Kind::kBus:
        return Health<bus_health_t>(channel, event, batch_.buses);
      case Kind::kRecorder:
        return Health<recorder_health_t>(channel, event, batch_.recorders);
      case Kind::kMotor:
        return Health<motor_health_t>(channel, event, batch_.motors);
      case Kind::kTime:
        return Health<time_quality_t>(channel, event, batch_.clocks);
      case Kind::kCommandStatus:
        return Decoded<command_status_t>(channel, event,
                                         [&](const command_status_t& message) { return Status(event, message); });
      case Kind::kCommand:
        return Decoded<command_t>(channel, event,
                                  [&](const command_t& message) { return Command(event, message); });
    }
    return Fate::kExcluded;
  }

  // Decodes a message and checks what all types have, then calls `handle`.
  template <typename Message, typename Handler>
  Fate Decoded(Channel& channel, const LogEvent& event, Handler handle) {
    const std::optional<Message> message = DecodeMessage<Message>(event.data);
    if (!message) return Odd(event, 0, kOddMalformed);
    if (message->machine_id != 0 && message->machine_id != machine_id_)
      return Odd(event, message->utime, kOddMachine);
    channel.received.On(message->boot_id, message->seq, InRange(event.utime), batch_.received);
    if (!range_.Contains(message->utime)) return Odd(event, message->utime, kOddTime);
    const Fate fate = handle(*message);
    if (fate == Fate::kStored || fate == Fate::kPosition) {
      if (batch_.first_utime == 0 || message->utime < batch_.first_utime) batch_.first_utime = message->utime;
      batch_.last_utime = std::max(batch_.last_utime, message->utime);
    }
    return fate;
  }

  Fate Odd(const LogEvent& event, std::int64_t utime, const char* cause) {
    batch_.odd.push_back({.event = event.number,
                          .channel = CleanText(event.channel),
                          .utime = utime,
                          .received = event.utime,
                          .cause = cause,
                          .message = {event.data.begin(), event.data.end()}});
    return Fate::kOdd;
  }

  Fate Position(Channel& channel, const LogEvent& event, const position_t& message) {
    if (!channel.window.IsNew(message.boot_id, message.seq)) return Fate::kRepeated;
    AddPositions(channel, event, message);
    return Fate::kPosition;
  }

  Fate Block(Channel& channel, const LogEvent& event, const position_block_t& message) {
    if (message.n <= 0) return Odd(event, message.utime, kOddMalformed);
    for (std::size_t i = 0; i < message.counts.size(); ++i) {
      if (!range_.Contains(BlockSampleUtime(message, i))) return Odd(event, message.utime, kOddTime);
    }
    if (!channel.window.IsNew(message.boot_id, message.seq)) return Fate::kRepeated;
    AddPositions(channel, event, message);
    return Fate::kPosition;
  }

  template <typename Message>
  void AddPositions(Channel& channel, const LogEvent& event, const Message& message) {
    if (!priming_) PositionsOf(channel).Add(message, event.number, event.utime, batch_);
  }

  // Returns the rows of the channel, which Take will end.
  PositionRows& PositionsOf(Channel& channel) {
    if (channel.positions->empty()) with_positions_.push_back(&channel);
    return *channel.positions;
  }

  Fate Alarm(Channel& channel, const LogEvent& event, const alarm_t& message) {
    const std::size_t before = batch_.alarms.size();
    channel.alarms->On(message, range_, batch_.alarms);
    for (std::size_t i = before; i < batch_.alarms.size(); ++i) batch_.alarms[i].event = event.number;
    return batch_.alarms.size() > before ? Fate::kStored : Fate::kRepeated;
  }

  Fate Trip(Channel& channel, const LogEvent& event, const trip_log_t& message) {
    TripRow row = TripRowOf(channel.choice.name, message);
    if (!trips_.IsNew({row.device, row.identity})) return Fate::kRepeated;
    row.event = event.number;
    batch_.trips.push_back(std::move(row));
    return Fate::kStored;
  }

  template <typename Message, typename Row>
  Fate Health(Channel& channel, const LogEvent& event, std::vector<Row>& rows) {
    return Decoded<Message>(channel, event, [&](const Message& message) {
      if (!channel.window.IsNew(message.boot_id, message.seq)) return Fate::kRepeated;
      if (!channel.health.IsDue(message.utime, StateKeyOf(message))) return Fate::kRepeated;
      rows.push_back(HealthRowOf(channel.choice.name, message));
      rows.back().event = event.number;
      return Fate::kStored;
    });
  }

  Fate Status(const LogEvent& event, const command_status_t& message) {
    if (message.is_final == 0 && message.finding == command_status_t::FINDING_NONE) return Fate::kExcluded;
    return StoreCommand(event, CommandRowOf(message));
  }

  Fate Command(const LogEvent& event, const command_t& message) {
    const auto body = DecodeMessage<command_body_t>(message.body);
    if (!body) return Odd(event, message.utime, kOddMalformed);
    if (body->mode == command_body_t::MODE_QUERY) return Fate::kExcluded;
    return StoreCommand(event, CommandRowOf(message, *body));
  }

  Fate StoreCommand(const LogEvent& event, FleetCommandRow row) {
    if (!commands_.IsNew({row.id, row.state, row.finding})) return Fate::kRepeated;
    row.event = event.number;
    batch_.commands.push_back(std::move(row));
    return Fate::kStored;
  }

  std::int64_t machine_id_;
  ChannelChooser chooser_;
  std::map<std::string, LogFacts::Device, std::less<>> devices_;
  UtimeRange range_;
  std::unordered_map<std::string, Channel, TextHash, std::equal_to<>> channels_;
  Channel unknown_;                       // see ChannelOf
  std::vector<Channel*> with_positions_;  // since the last Take
  RecentKeys<std::pair<std::string, std::int64_t>> trips_;
  RecentKeys<std::tuple<std::array<std::uint8_t, 16>, std::string, std::string>> commands_;
  RawRecords raw_;
  bool priming_ = false;
  BatchRows batch_;
};

RowComposer::RowComposer(LogFacts facts, std::string log, DetailRules detail, UtimeRange range)
    : work_(std::make_unique<Work>(std::move(facts), std::move(log), std::move(detail), range)) {}
RowComposer::~RowComposer() = default;
RowComposer::RowComposer(RowComposer&&) noexcept = default;
RowComposer& RowComposer::operator=(RowComposer&&) noexcept = default;

void RowComposer::SetRange(UtimeRange range) { work_->SetRange(range); }
void RowComposer::Prime(const LogEvent& event) { work_->Prime(event); }
void RowComposer::Add(const LogEvent& event) { work_->Add(event); }
void RowComposer::EndStretch() { work_->EndStretch(); }
BatchRows RowComposer::Take() { return work_->Take(); }

}  // namespace axlecast
