#include "drivers/tsubaki_sc/device.h"

#include <algorithm>
#include <axlecast/command_status_t.hpp>
#include <utility>
#include <variant>

#include "drivers/runtime/device/outcome_text.h"
#include "drivers/tsubaki_sc/alarms.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

// Within a reply the bytes follow each other at once (guideline 4), but an adapter's latency timer may hold them back
// for 16 ms.
constexpr MonoNs kQuiet = 25 * kMillisecond;
constexpr int kSilentAfter = 2;
// Trips that follow each other faster than a log is read must not take the live data away.
constexpr int kMostSuspensions = 2;

const ScSettings& Own(const DeviceConfig& device) { return static_cast<const ScSettings&>(*device.settings); }

bool Same(Bytes a, Bytes b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

}  // namespace

ScDevice::ScDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output, SecretSource& secrets)
    : owned_(device.settings),
      settings_(Own(device)),
      character_(bus.simulate ? 0 : bus.link.line.WireTime(1)),
      saturated_(bus.poll_hz <= 0),
      output_(output),
      requests_(settings_.address, settings_.timeout),
      passwords_(settings_, secrets),
      login_(requests_, passwords_, settings_.password_format),
      interpreter_(settings_.password_format.order, output),
      shop_{settings_, requests_, passwords_, login_, interpreter_.trips(), output_},
      urgent_(output),
      order_(output) {}

Step ScDevice::Next(const Turn& turn) const {
  if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
  if (turn.now < quiet_until_) return {.action = Silence{quiet_until_ - turn.now}, .priority = Priority::kLive};
  if (urgent_.Wants(turn.now)) return StepOf(WorkAt(Priority::kStop), Priority::kStop);
  if (order_.Wants(turn.now)) return StepOf(WorkAt(Priority::kCommand), Priority::kCommand);
  if (turn.live_due) return StepOf(WorkAt(Priority::kLive), Priority::kLive);
  return BackgroundStep(turn.now);
}

// Between its live turns: on a bus that is not full, and in the turns that are kept for it.
Step ScDevice::BackgroundStep(MonoNs now) const {
  const TripReader& trips = interpreter_.trips();
  if (fence_ || !answering_ || login_.active()) return {.action = Idle{kNever}, .priority = Priority::kLive};
  // A slot for each half would halve the rate that the configuration asks for.
  if (!saturated_ && status_next_) return StepOf(Work::kLive, Priority::kLive);
  if (trips.fresh()) return StepOf(Work::kTrip, Priority::kTrip);
  const bool slow_due = now >= slow_.due();
  if (trips.wanted() && (history_next_ || !slow_due)) return StepOf(Work::kTrip, Priority::kSlow);
  if (slow_due) return StepOf(Work::kSlow, Priority::kSlow);
  return {.action = Idle{slow_.due()}, .priority = Priority::kSlow};
}

Step ScDevice::StepOf(Work work, Priority priority) const {
  return {.action = ExchangeOf(work), .priority = priority};
}

Exchange ScDevice::ExchangeOf(Work work) const {
  switch (work) {
    case Work::kFence:
      return requests_.Read(kMains);
    case Work::kLogin:
      return login_.Next();
    case Work::kUrgent:
      return urgent_.procedure().Next();
    case Work::kOrder:
      return order_.procedure().Next();
    case Work::kTrip:
      return requests_.Read(interpreter_.trips().Next());
    case Work::kSlow:
      return requests_.Read(slow_.Next());
    default:
      return requests_.Read(status_next_ ? kStatus : kAnalog);
  }
}

ScDevice::Work ScDevice::WorkAt(Priority priority) const {
  switch (priority) {
    case Priority::kStop:
      return OrderWork(urgent_, Work::kUrgent);
    case Priority::kCommand:
      return OrderWork(order_, Work::kOrder);
    case Priority::kLive:
      return LiveWork();
    case Priority::kTrip:
      return Work::kTrip;
    default:
      return Work::kSlow;
  }
}

ScDevice::Work ScDevice::OrderWork(const OrderSlot& slot, Work own) const {
  if (!slot.waits_for_login() && slot.procedure().unfenced()) return own;
  if (fence_) return Work::kFence;
  return slot.waits_for_login() ? Work::kLogin : own;
}

ScDevice::Work ScDevice::LiveWork() const {
  const TripReader& trips = interpreter_.trips();
  if (fence_ || !answering_) return Work::kFence;
  if (login_.active()) return Work::kLogin;
  if (slow_.identity_first()) return Work::kSlow;
  if (trips.fresh()) {
    const bool suspend = settings_.trip_fetch == TripFetchMode::kSuspendLive && trips.log() == 0 &&
                         trips.restarts() < kMostSuspensions;
    if (suspend || !lent_) return Work::kTrip;
  } else if (slow_.introducing() && !lent_) {
    return Work::kSlow;
  }
  return Work::kLive;
}

OrderSlot* ScDevice::SlotAt(Priority priority) {
  return priority == Priority::kStop ? &urgent_ : priority == Priority::kCommand ? &order_ : nullptr;
}

void ScDevice::OnStarted(const Step& step, MonoNs) {
  const auto* exchange = std::get_if<Exchange>(&step.action);
  if (exchange == nullptr) return;
  priority_ = step.priority;
  in_flight_ = WorkAt(priority_);
  const bool background = priority_ == Priority::kSlow && interpreter_.trips().wanted();
  if (background && Same(exchange->request, ExchangeOf(Work::kTrip).request)) in_flight_ = Work::kTrip;
  // The second half between two slots.
  if (priority_ == Priority::kLive && Same(exchange->request, ExchangeOf(Work::kLive).request)) {
    in_flight_ = Work::kLive;
  }
  if (priority_ == Priority::kLive) lent_ = in_flight_ != Work::kLive;
  if (OrderSlot* slot = SlotAt(priority_)) {
    if (in_flight_ == Work::kUrgent || in_flight_ == Work::kOrder) slot->OnStarted();
  }
}

void ScDevice::On(const Event& event) {
  const MonoNs now = std::max(event.sent.last, event.received.last);
  switch (event.kind) {
    case Event::Kind::kReply:
    case Event::Kind::kTimeout:
      OnExchange(event);
      break;
    case Event::Kind::kStray:
    case Event::Kind::kUnsolicited:
      // Which unit it came from cannot be told; that of the late reply will notice it itself, by its fence.
      output_.OnError(ErrorKind::kStray, event.received);
      quiet_until_ = std::max(quiet_until_, now + kQuiet);
      break;
    case Event::Kind::kSilent:
      quiet_until_ = 0;
      break;
    case Event::Kind::kLinkUp:
      OnLinkUp(now);
      break;
    case Event::Kind::kLinkDown:
      OnLinkDown();
      break;
    default:
      break;
  }
  urgent_.ExpireIfLate(now);
  order_.ExpireIfLate(now);
}

void ScDevice::OnExchange(const Event& event) {
  const Answer answer = Interpret(event, character_);
  const Work work = std::exchange(in_flight_, Work::kNone);
  Track(answer);
  // What the unit refuses to an order is the order's; to a reading it is a fault of that reading.
  const bool asked_by_order = work == Work::kOrder || work == Work::kUrgent || work == Work::kLogin;
  if (!answer.ok() && !(answer.refused() && asked_by_order)) output_.OnError(*answer.error, answer.at);
  interpreter_.OnAnswer(answer);
  Settle(work, answer);
  if (work != Work::kLogin) LogInIfWanted(answer);
}

void ScDevice::Track(const Answer& answer) {
  if (answer.unclear) {
    fence_ = true;
    quiet_until_ = answer.end + kQuiet;
  }
  if (answer.error == ErrorKind::kTimeout) {
    if (++silent_ == kSilentAfter) Disappear();
    return;
  }
  silent_ = 0;
  answering_ = answering_ || answer.ok() || answer.refused();
}

void ScDevice::Settle(Work work, const Answer& answer) {
  switch (work) {
    case Work::kFence:
      return OnFence(answer);
    case Work::kLogin:
      return OnLoginAnswer(answer);
    case Work::kUrgent:
      return OnOrderAnswer(urgent_, answer);
    case Work::kOrder:
      return OnOrderAnswer(order_, answer);
    case Work::kLive:
      // A half that failed waits for its next turn: the other one may be readable.
      status_next_ = answer.block == kAnalog;
      return;
    case Work::kTrip:
      history_next_ = false;
      if (!answer.ok()) interpreter_.trips().OnFailure(answer);
      return;
    case Work::kSlow:
      history_next_ = true;
      return slow_.OnAnswer(answer);
    default:
      return;
  }
}

// Also an error is an answer to this request and to no other.
void ScDevice::OnFence(const Answer& answer) {
  OrderSlot* slot = SlotAt(priority_);
  if (!answer.unclear) {
    fence_ = false;
    if (slot != nullptr) slot->OnFencePassed();
  } else if (slot != nullptr) {
    slot->OnFenceFailed(CauseOf(answer));
  }
}

void ScDevice::OnOrderAnswer(OrderSlot& slot, const Answer& answer) {
  if (slot.held() && slot.TakeLogin(answer)) return StartLogin();
  slot.OnAnswer(answer);
}

// Somebody waits for it, or motor_control wants it.
void ScDevice::StartLogin() {
  if (!login_.active() && !login_.Start()) EndLogin(false, 0);
}

void ScDevice::OnLoginAnswer(const Answer& answer) {
  const Login::Result result = login_.OnAnswer(answer);
  if (result != Login::Result::kGoing) EndLogin(result == Login::Result::kLoggedIn, answer.end);
}

void ScDevice::EndLogin(bool logged_in, MonoNs now) {
  if (logged_in || login_.wrong_password()) {
    output_.OnAlarm(kWrongPassword, logged_in ? AlarmState::kAbsent : AlarmState::kDriverLatched, now);
  }
  const bool missed = !logged_in && settings_.motor_control != MotorControl::kNone;
  output_.OnAlarm(kLoginFailed, missed ? AlarmState::kLive : AlarmState::kAbsent, now);
  for (OrderSlot* slot : {&urgent_, &order_}) {
    if (!slot->held() || !slot->waits_for_login()) continue;
    if (logged_in)
      slot->OnLoggedIn();
    else
      slot->GiveUp(Reason::REASON_DEVICE_REFUSED, login_.problem());
  }
}

// So that a stop needs no login first.
void ScDevice::LogInIfWanted(const Answer& answer) {
  const bool logged_out = answer.ok() && answer.block == kLoginStatus && interpreter_.reading().logged_in == 0;
  if (!logged_out || settings_.motor_control == MotorControl::kNone || login_.wrong_password()) return;
  StartLogin();
}

void ScDevice::Disappear() {
  answering_ = false;
  status_next_ = false;
  login_.Abort("the unit does not answer");
  interpreter_.Forget();
  slow_.Restart();
}

void ScDevice::OnLinkUp(MonoNs now) {
  link_up_ = true;
  Disappear();
  silent_ = 0;
  fence_ = true;
  quiet_until_ = now + kQuiet;
}

void ScDevice::OnLinkDown() {
  link_up_ = false;
  in_flight_ = Work::kNone;
  Disappear();
  urgent_.GiveUp(Reason::REASON_NO_REPLY, "the link was lost");
  order_.GiveUp(Reason::REASON_NO_REPLY, "the link was lost");
}

void ScDevice::Begin(const Order& order, MonoNs now) {
  auto made = Admit(order, now);
  if (const Outcome* refused = std::get_if<Outcome>(&made)) return output_.OnOutcome(order.id, *refused);
  OrderSlot& slot = order.operation == kStopMotorName ? urgent_ : order_;
  if (order.operation == kLogInName) login_.Allow();
  slot.Take(order, std::move(std::get<std::unique_ptr<Procedure>>(made)));
  if (slot.waits_for_login()) StartLogin();
}

std::optional<Outcome> ScDevice::Refusal(const Order& order, MonoNs now) const {
  return RefusalOf(Admit(order, now));
}

// What is wrong with the order itself comes first: it will not pass.
Made ScDevice::Admit(const Order& order, MonoNs now) const {
  auto made = MakeProcedure(order, shop_);
  if (RefusalOf(made)) return made;
  if (auto refusal = RefusalNow(order, now)) return *std::move(refusal);
  return made;
}

std::optional<Outcome> ScDevice::RefusalNow(const Order& order, MonoNs now) const {
  const bool urgent = order.operation == kStopMotorName;
  if (auto refusal = RefusalToBegin((urgent ? urgent_ : order_).held(), order, now, link_up_)) return refusal;
  // A stop is tried on a unit that seems to be gone, too, and whatever it said last.
  if (urgent) return std::nullopt;
  if (!answering_) {
    return Rejected(Reason::REASON_DEVICE_OFFLINE,
                    "the unit does not answer: check its power, its cable and address");
  }
  MotorReading state = interpreter_.reading();
  if (login_.active()) state.logged_in = -1;  // a login is under way: what was read before it says nothing
  if (auto refusal = RefusalByState(order.operation, state)) return refusal;
  if (state.logged_in != 0 || !NeedsLogin(order.operation)) return std::nullopt;
  const std::string problem = login_.Obstacle();
  return problem.empty() ? std::nullopt : std::optional(Rejected(Reason::REASON_DEVICE_REFUSED, problem));
}

bool ScDevice::Cancel(const CommandId& id, MonoNs) { return urgent_.Cancel(id) || order_.Cancel(id); }

}  // namespace axlecast::tsubaki_sc
