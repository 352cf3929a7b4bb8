#include "drivers/saa_can/node_configuration.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>

#include "core/device/operation.h"
#include "drivers/kit/command_runner.h"
#include "drivers/saa_can/procedures.h"

namespace axlecast::saa_can {
namespace {

using Reason = command_status_t;

constexpr MonoNs kMinTimeout = 500 * kMillisecond;
constexpr int kTimeoutPeriods = 4;
// The command that enters configuration mode is not answered.
constexpr MonoNs kEntering = 50 * kMillisecond;
// After the first reply: another reply shows that a node was connected that had not sent anything.
constexpr MonoNs kMoreReplies = 200 * kMillisecond;

// Returns the commands with which root brings the interface up at this rate, in one line.
std::string IpLinkLine(const std::string& iface, std::int64_t bitrate) {
  return Text("ip link set %s down; ip link set %s up type can bitrate %lld restart-ms 100", iface.c_str(),
              iface.c_str(), static_cast<long long>(bitrate));
}

std::string NodeText(unsigned node) { return Text("0x%02x", node); }

Outcome ReadBackDiffers(std::string text) {
  return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS, std::move(text));
}

}  // namespace

NodeSearch::NodeSearch(std::uint8_t first, std::uint8_t second, const SaaCanSettings& settings)
    : nodes_{first, second},
      timeout_(std::max({kMinTimeout, settings.timeout, kTimeoutPeriods * settings.period})) {}

Procedure::Need NodeSearch::NextNeed() const {
  if (delivery_.state() != Delivery::State::kIdle) return Procedure::Nothing{};
  return CommandFrame(Command::kRead, node());
}

NodeSearch::Progress NodeSearch::On(const Event& event, MonoNs now) {
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

NodeConfigurationProcedure::NodeConfigurationProcedure(const Target& target, const OperationContext& context,
                                                       MonoNs now)
    : target_(target),
      context_(context),
      until_(now + kListen),
      search_(target.node, context.settings.node, context.settings) {}

Procedure::Need NodeConfigurationProcedure::NextNeed(MonoNs) const {
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

MonoNs NodeConfigurationProcedure::Due(MonoNs) const {
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

void NodeConfigurationProcedure::OnStarted(const CanFrame& frame) {
  if (stage_ == Stage::kSearch) {
    search_.OnStarted(frame);
  } else {
    delivery_.Start(frame);
  }
}

// ---- events ----

std::optional<Outcome> NodeConfigurationProcedure::On(const Event& event, const Interpreter::Evaluation&,
                                                      MonoNs now) {
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

// A bench receives every frame of the bus.
void NodeConfigurationProcedure::Watch(const Event& event) {
  if (event.kind != Event::Kind::kFrame || (event.id & kCanError) != 0) return;
  if (event.id == DataId(context_.settings.node)) {
    encoder_found_ = true;
  } else {
    other_ = event.id;
  }
}

void NodeConfigurationProcedure::Enter(Stage stage) {
  stage_ = stage;
  delivery_ = {};
}

void NodeConfigurationProcedure::End(Outcome outcome) {
  ending_ = std::move(outcome);
  Enter(Stage::kLeave);
}

std::optional<Outcome> NodeConfigurationProcedure::OnListened(MonoNs now) {
  if (other_) return OtherNodeFound();
  if (now < until_) return std::nullopt;
  if (!encoder_found_) {
    return Rejected(Reason::REASON_NO_REPLY, "no frame of the encoder came while listening for other nodes");
  }
  Enter(Stage::kEnter);
  Outcome running;
  running.text =
      Text("in %.1f s no node except 0x%02X sent a frame",
           static_cast<double>(kListen) / static_cast<double>(kSecond), unsigned{context_.settings.node});
  running.progress = 0.3F;
  return running;
}

std::optional<Outcome> NodeConfigurationProcedure::OnEntered(MonoNs now) {
  if (!IsOnItsWay()) return other_ ? std::optional(OtherNodeFound()) : std::nullopt;
  if (!IsOnBus() || now < Due(now)) return std::nullopt;
  Enter(Stage::kSet);
  if (other_) End(OtherNodeFound());
  return std::nullopt;
}

std::optional<Outcome> NodeConfigurationProcedure::OnSet() {
  if (!set_ && other_) End(OtherNodeFound());
  if (!IsOnBus()) return std::nullopt;
  until_ = delivery_.on_bus_at() + context_.settings.reply_window;
  Enter(Stage::kReply);
  return std::nullopt;
}

std::optional<Outcome> NodeConfigurationProcedure::OnReply(const Event& event, MonoNs now) {
  const bool may_reply = event.id == kConfigureId || event.id == kConfigureReplyId;
  const std::optional<ServiceReply> reply =
      event.kind == Event::Kind::kFrame && may_reply ? ParseServiceReply(event.bytes) : std::nullopt;
  if (reply && reply->service == target_.service) {
    if (replies_++ == 0) until_ = now + kMoreReplies;
    if (reply->result != 0) {
      refused_ = true;
      End(Final(CommandState::kFailed, Reason::REASON_DEVICE_REFUSED,
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
std::optional<Outcome> NodeConfigurationProcedure::OnLeft() {
  const Delivery::State state = delivery_.state();
  const bool over = state == Delivery::State::kOnBus || state == Delivery::State::kRefused ||
                    state == Delivery::State::kNotConfirmed;
  if (!over) return std::nullopt;
  if (ending_) return WithChange(std::move(*ending_));
  Enter(Stage::kSearch);
  return std::nullopt;
}

std::optional<Outcome> NodeConfigurationProcedure::OnSearched(const Event& event, MonoNs now) {
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

// ---- outcomes ----

Outcome NodeConfigurationProcedure::OtherNodeFound() const {
  return Rejected(Reason::REASON_NOT_PERMITTED,
                  Text("frames 0x%03X of another node came too, and every node would make the change: connect the "
                       "encoder alone",
                       unsigned{*other_ & kCanExtendedMask}));
}

Outcome NodeConfigurationProcedure::BitrateOutcome() const {
  const auto rate = static_cast<long long>(target_.bitrate);
  const std::string bring_up = IpLinkLine(context_.settings.iface, target_.bitrate);
  if (replies_ == 0) {
    return NotReceived(CommandState::kIndeterminate,
                       "no reply came: it may have either rate. To look at the new one, as root: " + bring_up);
  }
  if (replies_ > 1) {
    return ReadBackDiffers(
        Text("%d nodes answered: more than one was connected, and all of them may run at %lld bit/s now", replies_,
             rate));
  }
  return Succeeded(false, "accepted; as root: " + bring_up +
                              Text("; set link.bitrate: %lld, power-cycle the encoder, restart the driver", rate));
}

Outcome NodeConfigurationProcedure::WithChange(Outcome outcome) const {
  const SaaCanSettings& before = context_.settings;
  if (target_.service == Service::kNode) {
    outcome.changes.push_back({"node", NodeText(before.node), set_ ? NodeText(target_.node) : ""});
  } else {
    outcome.changes.push_back(
        {"bitrate", std::to_string(before.wire_bitrate), set_ ? std::to_string(target_.bitrate) : ""});
  }
  return outcome;
}

Outcome NodeConfigurationProcedure::OnLinkLost() const {
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

// ---- ReadNode ----

std::optional<Outcome> ReadNode::On(const Event& event, const Interpreter::Evaluation&, MonoNs now) {
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

}  // namespace axlecast::saa_can
