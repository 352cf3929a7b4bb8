#pragma once

#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <optional>
#include <string>
#include <utility>

#include "drivers/saa_can/procedure.h"
#include "drivers/saa_can/settings.h"

namespace axlecast::saa_can {

inline constexpr MonoNs kMinSearchTimeout = 500 * kMillisecond;
inline constexpr int kSearchPeriods = 4;
// The command that enters configuration mode is not answered.
inline constexpr MonoNs kEntering = 50 * kMillisecond;
// After the first reply: another reply shows that a node was connected that had not sent anything.
inline constexpr MonoNs kMoreReplies = 200 * kMillisecond;

// Returns the commands with which root brings the interface up at this rate, in one line.
inline std::string IpLinkLine(const std::string& iface, std::int64_t bitrate) {
  return Text("ip link set %s down; ip link set %s up type can bitrate %lld restart-ms 100", iface.c_str(),
              iface.c_str(), static_cast<long long>(bitrate));
}

inline std::string NodeText(unsigned node) { return Text("0x%02x", node); }

inline Outcome ReadBackDiffers(std::string text) {
  return Final(CommandState::kFailed, command_status_t::REASON_READ_BACK_DIFFERS, std::move(text));
}

// Finds out at which of two node ids an encoder answers 80 NN. The bus must be a bench.
class NodeSearch {
 public:
  enum class Progress : std::uint8_t { kRunning, kFirst, kSecond, kNowhere };

  NodeSearch(std::uint8_t first, std::uint8_t second, const SaaCanSettings& settings)
      : nodes_{first, second},
        timeout_(std::max({kMinSearchTimeout, settings.timeout, kSearchPeriods * settings.period})) {}

  [[nodiscard]] Procedure::Need NextNeed() const {
    if (delivery_.state() != Delivery::State::kIdle) return Procedure::Nothing{};
    return CommandFrame(Command::kRead, node());
  }
  [[nodiscard]] MonoNs due() const { return due_; }
  void OnStarted(const CanFrame& frame) { delivery_.Start(frame); }
  [[nodiscard]] Progress On(const Event& event, MonoNs now) {
    if (delivery_.state() == Delivery::State::kIdle) return Progress::kRunning;
    delivery_.On(event, now);
    if (due_ == kNever) due_ = now + timeout_;
    if (event.kind == Event::Kind::kFrame && event.id == DataId(node())) {
      return tried_ == 0 ? Progress::kFirst : Progress::kSecond;
    }
    if (now < due_) return Progress::kRunning;
    if (tried_ + 1 == nodes_.size()) return Progress::kNowhere;
    ++tried_;
    delivery_ = {};
    due_ = kNever;
    return Progress::kRunning;
  }

 private:
  [[nodiscard]] std::uint8_t node() const { return nodes_.at(tried_); }

  const std::array<std::uint8_t, 2> nodes_;
  const MonoNs timeout_;
  std::size_t tried_ = 0;
  Delivery delivery_;
  MonoNs due_ = kNever;  // the answer to the request must come by then
};

// Gives the encoder another node id or bit rate through the dialogue on 7E5 (SAA manual 5.4.1 (3) ②③), which every node
// on the bus obeys. Therefore it first listens, and continues only if no other node is received. It checks this again
// before each frame. Each frame is sent once.
//
// After a new node id, the encoder leaves configuration mode (CiA 305; the manual does not describe this), and the id at
// which it answers decides. After a new bit rate nothing more is sent: the interface still has the old rate.
class NodeConfigurationProcedure final : public Procedure {
 public:
  struct Target {
    Service service = Service::kNode;
    std::uint8_t node = 0;     // kNode
    std::int64_t bitrate = 0;  // kBitrate
  };
  NodeConfigurationProcedure(const Target& target, const OperationContext& context, MonoNs now)
      : target_(target),
        context_(context),
        until_(now + kListen),
        search_(target.node, context.settings.node, context.settings) {}

  [[nodiscard]] Need NextNeed(MonoNs) const override {
    if (IsOnItsWay()) return Nothing{};
    switch (stage_) {
      case Stage::kEnter:
        return ModeFrame(true);
      case Stage::kSet:
        if (target_.service == Service::kNode) return NodeFrame(target_.node);
        return BitrateFrame(*BitrateCode(target_.bitrate));
      case Stage::kLeave:
        return ModeFrame(false);
      case Stage::kSearch:
        return search_.NextNeed();
      default:
        return Nothing{};
    }
  }
  [[nodiscard]] MonoNs Due(MonoNs) const override {
    switch (stage_) {
      case Stage::kListen:
      case Stage::kReply:
        return until_;
      case Stage::kEnter:
        return IsOnBus() ? delivery_.on_bus_at() + kEntering : delivery_.due();
      case Stage::kSearch:
        return search_.due();
      default:
        return delivery_.due();
    }
  }
  void OnStarted(const CanFrame& frame) override {
    if (stage_ == Stage::kSearch) {
      search_.OnStarted(frame);
    } else {
      delivery_.Start(frame);
    }
  }
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation&, MonoNs now) override {
    if (!set_) Watch(event);
    delivery_.On(event, now);
    set_ = set_ || (stage_ == Stage::kSet && delivery_.state() > Delivery::State::kRefused);
    if (stage_ != Stage::kLeave) {
      if (auto failed = NotDelivered(delivery_, context_.settings)) return WithChange(std::move(*failed));
    }
    switch (stage_) {
      case Stage::kListen:
        return OnListened(now);
      case Stage::kEnter:
        return OnEntered(now);
      case Stage::kSet:
        return OnSet();
      case Stage::kReply:
        return OnReply(event, now);
      case Stage::kLeave:
        return OnLeft();
      default:
        return OnSearched(event, now);
    }
  }
  [[nodiscard]] Outcome OnLinkLost() const override {
    if (!touched()) return LinkLostBefore();
    if (ending_) return WithChange(*ending_);
    if (!set_) {
      return NotReceived(
          CommandState::kFailed,
          "nothing was changed, but the encoder may be in configuration mode: turn its power off and on");
    }
    if (target_.service == Service::kBitrate) return WithChange(LinkLostAfter("see at which bit rate it sends"));
    return WithChange(LinkLostAfter("read_position after=\"set_node_id node=" + NodeText(target_.node) + "\""));
  }
  [[nodiscard]] bool touched() const override { return stage_ > Stage::kEnter || IsOnItsWay(); }
  [[nodiscard]] bool alone() const override { return stage_ > Stage::kListen; }
  [[nodiscard]] bool silences() const override { return set_ && target_.service == Service::kBitrate && !refused_; }

  // Three periods of the slowest encoder, one position a second.
  static constexpr MonoNs kListen = 3'500 * kMillisecond;

 private:
  enum class Stage : std::uint8_t { kListen, kEnter, kSet, kReply, kLeave, kSearch };

  [[nodiscard]] bool IsOnItsWay() const { return delivery_.state() != Delivery::State::kIdle; }
  [[nodiscard]] bool IsOnBus() const { return delivery_.state() == Delivery::State::kOnBus; }
  // A bench receives every frame of the bus.
  void Watch(const Event& event) {
    if (event.kind != Event::Kind::kFrame || (event.id & kCanError) != 0) return;
    if (event.id == DataId(context_.settings.node)) {
      encoder_found_ = true;
    } else {
      other_ = event.id;
    }
  }
  std::optional<Outcome> OnListened(MonoNs now) {
    if (other_) return OtherNodeFound();
    if (now < until_) return std::nullopt;
    if (!encoder_found_) {
      return Rejected(command_status_t::REASON_NO_REPLY,
                      "no frame of the encoder came while listening for other nodes");
    }
    Enter(Stage::kEnter);
    Outcome running;
    running.text =
        Text("in %.1f s no node except 0x%02X sent a frame",
             static_cast<double>(kListen) / static_cast<double>(kSecond), unsigned{context_.settings.node});
    running.progress = 0.3F;
    return running;
  }
  std::optional<Outcome> OnEntered(MonoNs now) {
    if (!IsOnItsWay()) return other_ ? std::optional(OtherNodeFound()) : std::nullopt;
    if (!IsOnBus() || now < Due(now)) return std::nullopt;
    Enter(Stage::kSet);
    if (other_) End(OtherNodeFound());
    return std::nullopt;
  }
  std::optional<Outcome> OnSet() {
    if (!set_ && other_) End(OtherNodeFound());
    if (!IsOnBus()) return std::nullopt;
    until_ = delivery_.on_bus_at() + context_.settings.reply_window;
    Enter(Stage::kReply);
    return std::nullopt;
  }
  std::optional<Outcome> OnReply(const Event& event, MonoNs now) {
    const bool may_reply = event.id == kConfigureId || event.id == kConfigureReplyId;
    const std::optional<ServiceReply> reply =
        event.kind == Event::Kind::kFrame && may_reply ? ParseServiceReply(event.bytes) : std::nullopt;
    if (reply && reply->service == target_.service) {
      if (replies_++ == 0) until_ = now + kMoreReplies;
      if (reply->result != 0) {
        refused_ = true;
        End(Final(CommandState::kFailed, command_status_t::REASON_DEVICE_REFUSED,
                  Text("the encoder refused it with code 0x%02X", unsigned{reply->result})));
        return std::nullopt;
      }
    }
    if (now < until_) return std::nullopt;
    if (target_.service == Service::kBitrate) return WithChange(BitrateOutcome());
    if (replies_ > 1) {
      End(ReadBackDiffers(
          Text("%d nodes answered: more than one was connected, and all of them may have node 0x%02X now; connect "
               "them one at a time",
               replies_, unsigned{target_.node})));
    } else {
      Enter(Stage::kLeave);
    }
    return std::nullopt;
  }
  // Nothing depends on whether the encoder needs this frame or receives it.
  std::optional<Outcome> OnLeft() {
    const Delivery::State state = delivery_.state();
    const bool over = state == Delivery::State::kOnBus || state == Delivery::State::kRefused ||
                      state == Delivery::State::kNotConfirmed;
    if (!over) return std::nullopt;
    if (ending_) return WithChange(std::move(*ending_));
    Enter(Stage::kSearch);
    return std::nullopt;
  }
  std::optional<Outcome> OnSearched(const Event& event, MonoNs now) {
    const unsigned to = target_.node;
    const unsigned from = context_.settings.node;
    const char* reply = replies_ > 0 ? "it accepted the change" : "no reply to the change came";
    switch (search_.On(event, now)) {
      case NodeSearch::Progress::kRunning:
        return std::nullopt;
      case NodeSearch::Progress::kFirst:
        return WithChange(Verified(Text(
            "the encoder answers as node 0x%02X: put node: 0x%02x into the file and restart the driver", to, to)));
      case NodeSearch::Progress::kSecond:
        if (replies_ == 0) {
          return WithChange(ReadBackDiffers(Text("%s, and the encoder still answers as node 0x%02X", reply, from)));
        }
        return WithChange(Succeeded(
            false, Text("it accepted the change, but still answers as node 0x%02X: turn its power off and on, put "
                        "node: 0x%02x into the file and restart the driver",
                        from, to)));
      default:
        return WithChange(
            NotReceived(CommandState::kIndeterminate,
                        Text("%s, and the encoder answers neither as node 0x%02X nor as 0x%02X: turn its power "
                             "off and on, then read_position after=\"set_node_id node=0x%02x\"",
                             reply, to, from, to)));
    }
  }
  // Keeps the final outcome until the encoder has left configuration mode.
  void End(Outcome outcome) {
    ending_ = std::move(outcome);
    Enter(Stage::kLeave);
  }
  void Enter(Stage stage) {
    stage_ = stage;
    delivery_ = {};
  }
  [[nodiscard]] Outcome OtherNodeFound() const {
    return Rejected(
        command_status_t::REASON_NOT_PERMITTED,
        Text("frames 0x%03X of another node came too, and every node would make the change: connect the "
             "encoder alone",
             unsigned{*other_ & kCanExtendedMask}));
  }
  [[nodiscard]] Outcome BitrateOutcome() const {
    const auto rate = static_cast<long long>(target_.bitrate);
    const std::string bring_up = IpLinkLine(context_.settings.iface, target_.bitrate);
    if (replies_ == 0) {
      return NotReceived(CommandState::kIndeterminate,
                         "no reply came: it may have either rate. To look at the new one, as root: " + bring_up);
    }
    if (replies_ > 1) {
      return ReadBackDiffers(
          Text("%d nodes answered: more than one was connected, and all of them may run at %lld bit/s now",
               replies_, rate));
    }
    return Succeeded(false,
                     "accepted; as root: " + bring_up +
                         Text("; set link.bitrate: %lld, power-cycle the encoder, restart the driver", rate));
  }
  [[nodiscard]] Outcome WithChange(Outcome outcome) const {
    const SaaCanSettings& before = context_.settings;
    if (target_.service == Service::kNode) {
      outcome.changes.push_back({"node", NodeText(before.node), set_ ? NodeText(target_.node) : ""});
    } else {
      outcome.changes.push_back(
          {"bitrate", std::to_string(before.wire_bitrate), set_ ? std::to_string(target_.bitrate) : ""});
    }
    return outcome;
  }

  const Target target_;
  const OperationContext context_;
  Stage stage_ = Stage::kListen;
  Delivery delivery_;  // of the stage's frame
  MonoNs until_;       // end of the stages kListen and kReply
  bool encoder_found_ = false;
  std::optional<std::uint32_t> other_;  // identifier of another node's frame
  bool set_ = false;                    // the frame that changes something is in the queue, or was on the bus
  bool refused_ = false;                // by the encoder
  int replies_ = 0;
  std::optional<Outcome> ending_;
  NodeSearch search_;
};

// Finds out at which node id the encoder answers, to see whether set_node_id took effect.
class ReadNode final : public ReadProcedure {
 public:
  ReadNode(std::uint8_t node, const OperationContext& context)
      : node_(node), context_(context), search_(node, context.settings.node, context.settings) {}

  [[nodiscard]] Need NextNeed(MonoNs) const override { return search_.NextNeed(); }
  [[nodiscard]] MonoNs Due(MonoNs) const override { return search_.due(); }
  void OnStarted(const CanFrame& frame) override { search_.OnStarted(frame); }
  std::optional<Outcome> On(const Event& event, const Interpreter::Evaluation&, MonoNs now) override {
    const NodeSearch::Progress progress = search_.On(event, now);
    if (progress == NodeSearch::Progress::kRunning) return std::nullopt;
    const unsigned before = context_.settings.node;
    if (progress == NodeSearch::Progress::kNowhere) {
      return NotReceived(CommandState::kFailed,
                         Text("the encoder answers neither as node 0x%02X nor as 0x%02X", unsigned{node_}, before));
    }
    const bool changed = progress == NodeSearch::Progress::kFirst;
    const unsigned found = changed ? node_ : before;
    Outcome outcome = Verified(Text("the encoder answers as node 0x%02X", found));
    if (changed) outcome.text += ": put node: " + NodeText(found) + " into the file and restart the driver";
    outcome.changes.push_back({"node", "", NodeText(found)});
    outcome.changes.push_back(FindingChange(FindingWord(changed)));
    return outcome;
  }
  [[nodiscard]] bool alone() const override { return true; }

 private:
  const std::uint8_t node_;
  const OperationContext context_;
  NodeSearch search_;
};

}  // namespace axlecast::saa_can
