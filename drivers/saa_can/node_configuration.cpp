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

constexpr MonoNs kPatience = 500 * kMillisecond;
constexpr int kPeriods = 4;

}  // namespace

NodeSearch::NodeSearch(std::uint8_t first, std::uint8_t second, const SaaCanSettings& settings)
    : nodes_{first, second},
      format_(settings.format),
      patience_(std::max({kPatience, settings.timeout, kPeriods * settings.period})) {}

std::optional<CanFrame> NodeSearch::Wants() const {
  if (delivery_.state() != Delivery::State::kIdle) return std::nullopt;
  return CommandFrame(Command::kRead, node());
}

NodeSearch::Progress NodeSearch::On(const Event& event, MonoNs now) {
  if (delivery_.state() == Delivery::State::kIdle) return Progress::kGoing;
  delivery_.On(event, now);
  if (due_ == kNever) due_ = now + patience_;
  if (event.kind == Event::Kind::kFrame && event.id == DataId(node())) {
    position_ = ParsePosition(event.bytes, format_);
    return tried_ == 0 ? Progress::kFirst : Progress::kSecond;
  }
  if (now < due_) return Progress::kGoing;
  if (tried_ + 1 == nodes_.size()) return Progress::kNowhere;
  ++tried_;
  delivery_ = {};
  due_ = kNever;
  return Progress::kGoing;
}

NodeConfigurationProcedure::NodeConfigurationProcedure(const Target& target, const OperationContext& context,
                                                       MonoNs now)
    : target_(target),
      context_(context),
      until_(now + kListen),
      search_(target.node, context.settings.node, context.settings) {}

CanFrame NodeConfigurationProcedure::SetFrame() const {
  return target_.service == Service::kNode ? NodeFrame(target_.node) : BitrateFrame(*BitrateCode(target_.bitrate));
}

Procedure::Want NodeConfigurationProcedure::Wants(MonoNs) const {
  if (IsOnItsWay()) return Nothing{};
  switch (stage_) {
    case Stage::kEnter:
      return ModeFrame(true);
    case Stage::kSet:
      return SetFrame();
    case Stage::kLeave:
      return ModeFrame(false);
    case Stage::kLook:
      if (const auto frame = search_.Wants()) return *frame;
      return Nothing{};
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
      return delivery_.state() == Delivery::State::kOnBus ? delivery_.on_bus_at() + kEntering : delivery_.due();
    case Stage::kLook:
      return search_.due();
    default:
      return delivery_.due();
  }
}

void NodeConfigurationProcedure::OnStarted(const CanFrame& frame) {
  if (stage_ == Stage::kLook) {
    search_.OnStarted(frame);
  } else {
    delivery_.Start(frame);
  }
}

// ---- what happened ----

std::optional<Outcome> NodeConfigurationProcedure::On(const Event& event, const Interpreter::Heard&, MonoNs now) {
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
      return OnLooked(event, now);
  }
}

// A bench hears every frame of the bus.
void NodeConfigurationProcedure::Watch(const Event& event) {
  if (event.kind != Event::Kind::kFrame || (event.id & kCanError) != 0) return;
  if (event.id == DataId(context_.settings.node)) {
    heard_ = true;
  } else {
    other_ = event.id;
  }
}

void NodeConfigurationProcedure::Go(Stage stage) {
  stage_ = stage;
  delivery_ = {};
}

void NodeConfigurationProcedure::End(Outcome outcome) {
  ending_ = std::move(outcome);
  Go(Stage::kLeave);
}

std::optional<Outcome> NodeConfigurationProcedure::OnListened(MonoNs now) {
  if (other_) return Crowded();
  if (now < until_) return std::nullopt;
  if (!heard_) return Rejected(Reason::REASON_NO_REPLY, "the encoder was not heard while listening for others");
  Go(Stage::kEnter);
  Outcome running;
  running.text =
      Text("in %.1f s nobody but node 0x%02X was heard",
           static_cast<double>(kListen) / static_cast<double>(kSecond), unsigned{context_.settings.node});
  running.progress = 0.3F;
  return running;
}

std::optional<Outcome> NodeConfigurationProcedure::OnEntered(MonoNs now) {
  if (!IsOnItsWay()) return other_ ? std::optional(Crowded()) : std::nullopt;
  if (delivery_.state() != Delivery::State::kOnBus || now < Due(now)) return std::nullopt;
  Go(Stage::kSet);
  if (other_) End(Crowded());
  return std::nullopt;
}

std::optional<Outcome> NodeConfigurationProcedure::OnSet() {
  if (!set_ && other_) End(Crowded());
  if (delivery_.state() != Delivery::State::kOnBus) return std::nullopt;
  until_ = delivery_.on_bus_at() + context_.settings.reply_window;
  Go(Stage::kReply);
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
  if (target_.service == Service::kBitrate) return WithChange(JudgeBitrate());
  if (replies_ > 1) {
    End(Final(
        CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
        Text("%d nodes answered: more than one was connected, and all of them may have node 0x%02X now; connect "
             "them one at a time",
             replies_, unsigned{target_.node})));
  } else {
    Go(Stage::kLeave);
  }
  return std::nullopt;
}

// Whether the encoder needs it, or takes it, is open: nothing hangs on it.
std::optional<Outcome> NodeConfigurationProcedure::OnLeft() {
  const Delivery::State state = delivery_.state();
  const bool over = state == Delivery::State::kOnBus || state == Delivery::State::kRefused ||
                    state == Delivery::State::kNotConfirmed;
  if (!over) return std::nullopt;
  if (ending_) return WithChange(std::move(*ending_));
  Go(Stage::kLook);
  return std::nullopt;
}

std::optional<Outcome> NodeConfigurationProcedure::OnLooked(const Event& event, MonoNs now) {
  const unsigned to = target_.node;
  const unsigned from = context_.settings.node;
  const char* reply = replies_ > 0 ? "it accepted the change" : "no reply to the change came";
  switch (search_.On(event, now)) {
    case NodeSearch::Progress::kGoing:
      return std::nullopt;
    case NodeSearch::Progress::kFirst:
      return WithChange(Verified(Text(
          "the encoder answers as node 0x%02X: put node: 0x%02x into the file and restart the driver", to, to)));
    case NodeSearch::Progress::kSecond:
      if (replies_ == 0) {
        return WithChange(Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                                Text("%s, and the encoder still answers as node 0x%02X", reply, from)));
      }
      return WithChange(Succeeded(
          false, Text("it accepted the change, but still answers as node 0x%02X: turn its power off and on, put "
                      "node: 0x%02x into the file and restart the driver",
                      from, to)));
    default:
      return WithChange(
          Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                Text("%s, and the encoder answers neither as node 0x%02X nor as 0x%02X: turn its power "
                     "off and on, then read_position after=\"set_node_id node=0x%02x\"",
                     reply, to, from, to)));
  }
}

// ---- words ----

Outcome NodeConfigurationProcedure::Crowded() const {
  return Rejected(Reason::REASON_NOT_PERMITTED,
                  Text("identifier 0x%03X is heard too, and every node would take the change: connect the encoder "
                       "alone",
                       unsigned{*other_ & kCanExtendedMask}));
}

Outcome NodeConfigurationProcedure::JudgeBitrate() const {
  const auto rate = static_cast<long long>(target_.bitrate);
  const std::string bring_up = IpLinkLine(context_.settings.iface, target_.bitrate);
  if (replies_ == 0) {
    return Final(CommandState::kIndeterminate, Reason::REASON_NO_REPLY,
                 "no reply came: it may have either rate. To look at the new one, as root: " + bring_up);
  }
  if (replies_ > 1) {
    return Final(CommandState::kFailed, Reason::REASON_READ_BACK_DIFFERS,
                 Text("%d nodes answered: more than one was connected, and all of them may run at %lld bit/s now",
                      replies_, rate));
  }
  return Succeeded(false, "accepted; as root: " + bring_up +
                              Text("; set link.bitrate: %lld, power-cycle the encoder, restart the driver", rate));
}

Outcome NodeConfigurationProcedure::WithChange(Outcome outcome) const {
  if (target_.service == Service::kNode) {
    outcome.changes.push_back({"node", Text("0x%02x", unsigned{context_.settings.node}),
                               set_ ? Text("0x%02x", unsigned{target_.node}) : ""});
  } else {
    outcome.changes.push_back(
        {"bitrate", std::to_string(target_.before), set_ ? std::to_string(target_.bitrate) : ""});
  }
  return outcome;
}

Outcome NodeConfigurationProcedure::OnLinkLost() const {
  if (!touched()) return LinkLost(false, "");
  if (ending_) return WithChange(*ending_);
  if (!set_) {
    return Final(CommandState::kFailed, Reason::REASON_NO_REPLY,
                 "nothing was changed, but the encoder may be in configuration mode: turn its power off and on");
  }
  if (target_.service == Service::kBitrate) return WithChange(LinkLost(true, "look at which bit rate it is heard"));
  return WithChange(
      LinkLost(true, Text("read_position after=\"set_node_id node=0x%02x\"", unsigned{target_.node}).c_str()));
}

// ---- LookForNode ----

LookForNode::LookForNode(std::uint8_t node, const OperationContext& context)
    : node_(node), context_(context), search_(node, context.settings.node, context.settings) {}

Procedure::Want LookForNode::Wants(MonoNs) const {
  if (const auto frame = search_.Wants()) return *frame;
  return Nothing{};
}

std::optional<Outcome> LookForNode::On(const Event& event, const Interpreter::Heard&, MonoNs now) {
  const NodeSearch::Progress progress = search_.On(event, now);
  if (progress == NodeSearch::Progress::kGoing) return std::nullopt;
  const unsigned before = context_.settings.node;
  if (progress == NodeSearch::Progress::kNowhere) {
    return NothingRead(Text("the encoder answers neither as node 0x%02X nor as 0x%02X", unsigned{node_}, before));
  }
  const bool changed = progress == NodeSearch::Progress::kFirst;
  const unsigned found = changed ? node_ : before;
  Outcome outcome = Verified(Text("the encoder answers as node 0x%02X", found));
  if (changed) outcome.text += Text(": put node: 0x%02x into the file and restart the driver", found);
  outcome.changes.push_back({"node", "", Text("0x%02x", found)});
  outcome.changes.push_back(FindingChange(FindingWord(changed)));
  return outcome;
}

Outcome LookForNode::OnLinkLost() const { return NothingRead("the link was lost before the encoder answered"); }

}  // namespace axlecast::saa_can
