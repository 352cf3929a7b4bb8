#include <algorithm>
#include <array>
#include <axlecast/command_status_t.hpp>
#include <memory>
#include <utility>
#include <variant>

#include "core/config/machine_config.h"
#include "drivers/tsubaki_sc/command_slot.h"
#include "drivers/tsubaki_sc/family.h"
#include "drivers/tsubaki_sc/interpreter.h"
#include "drivers/tsubaki_sc/operations.h"

namespace axlecast::tsubaki_sc {
namespace {

using Reason = command_status_t;

// Within a reply the bytes follow each other at once (guideline 4), but an adapter's latency timer may hold them back
// for 16 ms.
constexpr MonoNs kQuiet = 25 * kMillisecond;
// A stop waits no longer than that for an idle line.
constexpr MonoNs kPatience = kQuiet;
constexpr int kSilentAfter = 2;
// Trips that follow each other faster than a log is read must not take the live data away.
constexpr int kMaxSuspensions = 2;

const ScSettings& Own(const DeviceConfig& device) { return static_cast<const ScSettings&>(*device.settings); }

bool Same(Bytes a, Bytes b) { return std::equal(a.begin(), a.end(), b.begin(), b.end()); }

bool IsStop(const DriverCommand& command) { return command.operation == kStopMotorName; }

// The order of the slow items, which are read in addition to the live data: once each when the unit appears, then one a
// second if the bus has slots for it.
class SlowPlan {
 public:
  // The unit has appeared: reads every item once, the MFG number first, because it identifies the unit.
  void Restart() { *this = {}; }
  // Returns whether some item was not read since Restart.
  [[nodiscard]] bool introducing() const { return introduced_ < kItems.size(); }
  // Returns whether the MFG number was not read since Restart.
  [[nodiscard]] bool identity_first() const { return introduced_ == 0; }
  [[nodiscard]] const Block& Next() const { return kItems[next_]; }
  [[nodiscard]] MonoNs due() const { return due_; }
  // The request of the item is over. An item that the unit does not know is left out from now on.
  void OnAnswer(const Answer& answer) {
    if (answer.refused()) unknown_ |= 1U << next_;
    if (!answer.ok() && MayRepeat(answer, failures_)) return;
    failures_ = 0;
    if (introducing()) ++introduced_;
    due_ = introducing() ? 0 : answer.end + kPeriod;
    for (std::size_t i = 0; i < kItems.size(); ++i) {
      next_ = next_ + 1 < kItems.size() ? next_ + 1 : 0;
      if ((unknown_ >> next_ & 1U) == 0) return;
    }
  }

 private:
  // The log interval is in the last of the parameters' blocks.
  static constexpr std::array<Block, 10> kItems = {
      kMfgNumber,   kStopCoil, kLoginStatus, kParameterBlocks[2], kMains,
      kProductCode, kVersion,  kSetValues,   kParameterBlocks[0], kParameterBlocks[1]};
  static constexpr MonoNs kPeriod = 1 * kSecond;

  std::size_t next_ = 0;
  std::size_t introduced_ = 0;
  std::uint32_t unknown_ = 0;  // bit i: the unit refuses item i
  int failures_ = 0;
  MonoNs due_ = 0;
};

// One SC unit: selects the next request. The Interpreter decodes the replies.
//
// - The fence: a Modbus reply does not contain its addresses, so a late reply could be taken for the reply to a later
//   request of the same length. If that is possible (timeout, damaged or unexpected reply, link up), the device first
//   reads the mains frequency (function 02), whose reply has a unique shape. A late reply to another request does not
//   match and is an error, and the fence is repeated. A stop does not wait for the fence: the echo of coil 100 is unique
//   too.
// - It transmits nothing while a reply may still arrive. A stop waits for that at most 25 ms.
// - A live slot reads 100-106 and 200-204 alternately. The log of a new trip (see trip_fetch), the login, and every other
//   request to a unit that has appeared use live slots too.
// - If the unit refuses a command with error 04 (logged out), the device logs in once and repeats the request. Unless the
//   configuration has log_out: false, the unit is logged out before the outcome is reported; after a stop, later.
class ScDevice final : public Device, private CommandRunner<Procedure>::Policy {
 public:
  ScDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output, SecretSource& secrets)
      : owned_(device.settings),
        settings_(Own(device)),
        character_(bus.simulate ? 0 : bus.link.line.ShortestCharacter()),
        saturated_(bus.poll_hz <= 0),
        output_(output),
        requests_(settings_.address, settings_.timeout),
        passwords_(settings_, secrets),
        login_(requests_, passwords_, settings_.password_format, settings_.log_out),
        interpreter_(settings_.password_format.order, output),
        context_{settings_, requests_, passwords_, login_, interpreter_.trips(), output_},
        urgent_(*this, output),
        command_(*this, output) {}

  [[nodiscard]] Step Next(const BusSlot& slot) const override {
    if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
    const bool urgent = !slot.reserved && urgent_.IsRunnable(slot.now);
    if (slot.now < quiet_until_ && !(urgent && slot.now >= busy_since_ + kPatience)) {
      return {.action = WaitForIdleLine{quiet_until_ - slot.now}, .priority = Priority::kLive};
    }
    if (urgent) {
      Step step = StepOf(WorkAt(Priority::kStop), Priority::kStop, slot.now);
      std::get<Exchange>(step.action).regardless = slot.now < quiet_until_;
      return step;
    }
    // The password follows the reading of the login state at once.
    const bool commands = !slot.reserved && (command_.IsRunnable(slot.now) || (login_.writing() && !fence_));
    if (commands) return StepOf(WorkAt(Priority::kCommand), Priority::kCommand, slot.now);
    if (slot.poll_due) return StepOf(WorkAt(Priority::kLive), Priority::kLive, slot.now);
    return BackgroundStep(slot.now);
  }
  void OnStarted(const Step& step, MonoNs now) override {
    const auto* exchange = std::get_if<Exchange>(&step.action);
    if (exchange == nullptr) return;
    priority_ = step.priority;
    in_flight_ = WorkAt(priority_);
    const bool background = priority_ == Priority::kSlow && interpreter_.trips().pending();
    if (background && Same(exchange->request, ExchangeOf(Work::kTrip, now).request)) in_flight_ = Work::kTrip;
    // The second half between two slots.
    if (priority_ == Priority::kLive && Same(exchange->request, ExchangeOf(Work::kLive, now).request)) {
      in_flight_ = Work::kLive;
    }
    if (priority_ == Priority::kLive) lent_ = in_flight_ != Work::kLive;
    if (CommandSlot* slot = SlotAt(priority_)) {
      const bool login = in_flight_ == Work::kLogin && slot->login_goal();
      if (login || in_flight_ == Work::kUrgent || in_flight_ == Work::kCommand) slot->OnStarted();
    }
  }
  void On(const Event& event) override {
    const MonoNs now = event.End();
    switch (event.kind) {
      case Event::Kind::kReply:
      case Event::Kind::kTimeout:
        OnExchange(event);
        break;
      case Event::Kind::kUnexpectedBytes:
      case Event::Kind::kUnsolicited:
        // The sender is not known. The unit with a late reply detects it with its fence.
        output_.OnError(ErrorKind::kUnexpectedBytes, event.received);
        if (now > quiet_until_) busy_since_ = now;
        quiet_until_ = std::max(quiet_until_, now + kQuiet);
        break;
      case Event::Kind::kSilent:
        quiet_until_ = 0;
        break;
      case Event::Kind::kLinkUp:
        link_up_ = true;
        Disappear();
        silent_ = 0;
        fence_ = true;
        quiet_until_ = now + kQuiet;
        break;
      case Event::Kind::kLinkDown:
        link_up_ = false;
        in_flight_ = Work::kNone;
        Disappear();
        urgent_.OnLinkLost();
        command_.OnLinkLost();
        break;
      default:
        break;
    }
    urgent_.ExpireIfLate(now);
    command_.ExpireIfLate(now);
    if (link_up_) PursueLogin(now);
  }
  [[nodiscard]] Result<> Validate(const DriverCommand& command, MonoNs now) const override {
    return (IsStop(command) ? urgent_ : command_).Validate(command, link_up_, now);
  }
  void Begin(const DriverCommand& command, MonoNs now) override {
    if (!(IsStop(command) ? urgent_ : command_).Begin(command, link_up_, now)) return;
    if (command.operation == kLogInName || command.operation == kLogOutName) login_.Allow();
    PursueLogin(now);
  }
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs) override {
    return urgent_.Cancel(id) || command_.Cancel(id);
  }

 private:
  // The purpose of an exchange.
  enum class Work : std::uint8_t { kNone, kFence, kLogin, kUrgent, kCommand, kLive, kTrip, kSlow };

  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs) const override {
    return tsubaki_sc::MakeProcedure(command, context_);
  }
  [[nodiscard]] Result<> CheckState(const DriverCommand& command, MonoNs) const override {
    // A stop is sent even if the unit seems to be off, whatever its last status was.
    if (IsStop(command)) return {};
    if (!answering_) return DeviceOffline("the unit does not answer: check its power, its cable and address");
    const MotorReading& reading = interpreter_.reading();
    if (command.operation == kStartMotorName) {
      if (Result<> startable = CheckNotTripped(reading.status_bits); reading.tripped && !startable)
        return startable;
    }
    // During a login, the state that was read before it may be outdated.
    const bool logged_out = reading.logged_in == 0 && !login_.active();
    if (!logged_out || !NeedsLogin(command.operation)) return {};
    if (const Result<> password = login_.CheckPassword(); !password) {
      return Failure(password.error().text, Reason::REASON_DEVICE_REFUSED);
    }
    return {};
  }

  // ---- steps ----

  // Returns the step between the live slots of the unit: on a bus that is not full, and in the reserved slots.
  [[nodiscard]] Step BackgroundStep(MonoNs now) const {
    const TripReader& trips = interpreter_.trips();
    if (fence_ || !answering_ || (login_.active() && !LoginOfCommand()))
      return {.action = Idle{kNever}, .priority = Priority::kLive};
    // A slot for each half would halve the configured rate.
    if (!saturated_ && status_next_) return StepOf(Work::kLive, Priority::kLive, now);
    if (trips.fresh()) return StepOf(Work::kTrip, Priority::kTrip, now);
    const bool slow_due = now >= slow_.due();
    if (trips.pending() && (history_next_ || !slow_due)) return StepOf(Work::kTrip, Priority::kSlow, now);
    if (slow_due) return StepOf(Work::kSlow, Priority::kSlow, now);
    return {.action = Idle{slow_.due()}, .priority = Priority::kSlow};
  }
  [[nodiscard]] Step StepOf(Work work, Priority priority, MonoNs now) const {
    return {.action = ExchangeOf(work, now), .priority = priority};
  }
  [[nodiscard]] Exchange ExchangeOf(Work work, MonoNs now) const {
    switch (work) {
      case Work::kFence:
        return requests_.Read(kMains);
      case Work::kLogin:
        return login_.Next(now);
      case Work::kUrgent:
        return urgent_.procedure().Next();
      case Work::kCommand:
        return command_.procedure().Next();
      case Work::kTrip:
        return requests_.Read(interpreter_.trips().Next());
      case Work::kSlow:
        return requests_.Read(slow_.Next());
      default:
        return requests_.Read(status_next_ ? kStatus : kAnalog);
    }
  }
  [[nodiscard]] Work WorkAt(Priority priority) const {
    switch (priority) {
      case Priority::kStop:
        return CommandWork(urgent_, Work::kUrgent);
      case Priority::kCommand:
        return login_.writing() && !fence_ ? Work::kLogin : CommandWork(command_, Work::kCommand);
      case Priority::kLive:
        return LiveWork();
      case Priority::kTrip:
        return Work::kTrip;
      default:
        return Work::kSlow;
    }
  }
  [[nodiscard]] Work CommandWork(const CommandSlot& slot, Work own) const {
    if (!slot.login_goal() && slot.procedure().unfenced()) return own;
    if (fence_) return Work::kFence;
    return slot.login_goal() ? Work::kLogin : own;
  }
  [[nodiscard]] Work LiveWork() const {
    const TripReader& trips = interpreter_.trips();
    if (fence_ || !answering_) return Work::kFence;
    if (login_.active() && !LoginOfCommand() && !lent_) return Work::kLogin;
    if (slow_.identity_first()) return Work::kSlow;
    if (trips.fresh()) {
      const bool suspend = settings_.trip_fetch == TripFetchMode::kSuspendLive && trips.log() == 0 &&
                           trips.restarts() < kMaxSuspensions;
      if (suspend || !lent_) return Work::kTrip;
    } else if (slow_.introducing() && !lent_) {
      return Work::kSlow;
    }
    return Work::kLive;
  }
  [[nodiscard]] CommandSlot* SlotAt(Priority priority) {
    return priority == Priority::kStop ? &urgent_ : priority == Priority::kCommand ? &command_ : nullptr;
  }

  // ---- answers ----

  void OnExchange(const Event& event) {
    const Answer answer = Interpret(event, character_);
    const Work work = std::exchange(in_flight_, Work::kNone);
    Track(answer);
    // A refusal is the result of a command, but an error of a reading.
    const bool asked_by_command = work == Work::kCommand || work == Work::kUrgent || work == Work::kLogin;
    if (!answer.ok() && !(answer.refused() && asked_by_command)) output_.OnError(*answer.error, answer.at);
    interpreter_.OnAnswer(answer);
    if (answer.ok() && answer.block == kLoginStatus) OnLoginStatus(work, answer);
    Settle(work, answer);
    if (work != Work::kLogin) LogInAtOnce(answer);
  }
  void Track(const Answer& answer) {
    if (answer.unclear) {
      fence_ = true;
      if (answer.end > quiet_until_) busy_since_ = answer.end;
      quiet_until_ = answer.end + kQuiet;
      login_.OnUnclear();
    }
    if (answer.error == ErrorKind::kTimeout) {
      if (++silent_ == kSilentAfter) Disappear();
      return;
    }
    silent_ = 0;
    answering_ = answering_ || answer.ok() || answer.refused();
  }
  void Settle(Work work, const Answer& answer) {
    switch (work) {
      case Work::kFence:
        return OnFence(answer);
      case Work::kLogin:
        return OnLoginAnswer(answer);
      case Work::kUrgent:
        return OnCommandAnswer(urgent_, answer);
      case Work::kCommand:
        return OnCommandAnswer(command_, answer);
      case Work::kLive:
        // A half that failed waits for its next slot: the other one may be readable.
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
  // An error is an answer to this request and to no other, too.
  void OnFence(const Answer& answer) {
    CommandSlot* slot = SlotAt(priority_);
    if (!answer.unclear) {
      fence_ = false;
      if (slot != nullptr) slot->OnFencePassed();
    } else if (slot != nullptr) {
      slot->OnFenceFailed(answer);
    }
  }
  void OnCommandAnswer(CommandSlot& slot, const Answer& answer) {
    if (!slot.OnAnswer(answer)) return;
    // A logout that is under way waits for the login.
    if (login_.active() && login_.goal() == LoginGoal::kOut) login_.Abort();
  }

  // ---- login ----

  void OnLoginAnswer(const Answer& answer) {
    const Result<bool> reached = login_.OnAnswer(answer);
    if (!reached) return EndLogin(Failure(reached.error()), answer.end);
    if (*reached) EndLogin({}, answer.end);
  }
  // Starts the login or logout for which a command waits, or the logout that is owed.
  void PursueLogin(MonoNs now) {
    if (login_.active()) return;
    for (CommandSlot* slot : {&urgent_, &command_}) {
      if (!slot->busy() || !slot->login_goal()) continue;
      // The procedure made sure that the unit stays logged in.
      if (slot->ended() && !login_.owes_log_out())
        slot->Release("");
      else
        return StartLogin(*slot->login_goal(), now);
    }
    const bool background = answering_ && login_.owes_log_out() && !log_out_failed_;
    if (background && !urgent_.busy() && !command_.busy()) StartLogin(LoginGoal::kOut, now);
  }
  void StartLogin(LoginGoal goal, MonoNs now) {
    if (const Result<> started = login_.Start(goal); !started) EndLogin(started, now);
  }
  void EndLogin(const Result<>& result, MonoNs now) {
    const bool done = result.has_value();
    const LoginGoal goal = login_.goal();
    const bool in = goal == LoginGoal::kIn;
    if (login_.wrong_password() || (in && done)) {
      const auto state = login_.wrong_password() ? AlarmState::kDriverLatched : AlarmState::kAbsent;
      output_.OnAlarm(kWrongPassword, state, now);
    }
    if (in) {
      const bool missed = !done && settings_.StaysLoggedIn();
      output_.OnAlarm(kLoginFailed, missed ? AlarmState::kLive : AlarmState::kAbsent, now);
    } else {
      log_out_failed_ = !done;
      output_.OnAlarm(kStillLoggedIn, done ? AlarmState::kAbsent : AlarmState::kLive, now);
    }
    for (CommandSlot* slot : {&urgent_, &command_}) {
      if (!slot->busy() || slot->login_goal() != goal) continue;
      if (done && in && !slot->ended() && slot->procedure().begins_with()) login_.Keep();
      if (done)
        slot->OnLoginDone(in && login_.owes_log_out() && slot == &command_);
      else
        slot->OnLoginFailed(result.error().text);
    }
  }
  // Returns whether the slots of a command move the login on; otherwise the live slots of the unit do.
  [[nodiscard]] bool LoginOfCommand() const { return urgent_.login_goal() || command_.login_goal(); }
  void OnLoginStatus(Work work, const Answer& answer) {
    const bool logged_in = interpreter_.reading().logged_in == 1;
    login_.OnStatusRead(logged_in);
    if (!logged_in) output_.OnAlarm(kStillLoggedIn, AlarmState::kAbsent, answer.end);
    if (work == Work::kSlow) log_out_failed_ = false;
  }
  // Logs in before a command needs it, so that a stop does not wait for a login.
  void LogInAtOnce(const Answer& answer) {
    const bool logged_out = answer.ok() && answer.block == kLoginStatus && interpreter_.reading().logged_in == 0;
    if (!logged_out || !settings_.StaysLoggedIn() || login_.wrong_password()) return;
    if (!login_.active()) StartLogin(LoginGoal::kIn, answer.end);
  }
  // The unit does not answer any more.
  void Disappear() {
    answering_ = false;
    status_next_ = false;
    login_.Abort();
    log_out_failed_ = false;
    interpreter_.Forget();
    slow_.Restart();
  }

  std::shared_ptr<const DeviceSettings> owned_;  // keeps settings_ alive
  const ScSettings& settings_;
  const MonoNs character_;  // 0 on a simulated line
  const bool saturated_;    // live data as fast as the bus allows
  DeviceOutput& output_;
  Requests requests_;
  PasswordTable passwords_;
  Login login_;
  Interpreter interpreter_;
  SlowPlan slow_;
  const OperationContext context_;
  CommandSlot urgent_;
  CommandSlot command_;

  bool link_up_ = false;
  bool answering_ = false;
  int silent_ = 0;  // exchanges in a row without a single byte
  bool fence_ = false;
  MonoNs quiet_until_ = 0;  // nothing is transmitted before
  MonoNs busy_since_ = 0;   // with quiet_until_: since when the line has not been idle
  Work in_flight_ = Work::kNone;
  Priority priority_ = Priority::kLive;  // of what is in flight
  bool status_next_ = false;             // the second half of the live data
  bool lent_ = false;                    // the last live slot was not used for live data
  bool log_out_failed_ = false;          // it is retried when the login state is read again
  bool history_next_ = true;             // in the slow slots: an old log is read next, not a slow item
};

}  // namespace

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output,
                                   SecretSource& secrets) {
  return std::make_unique<ScDevice>(bus, device, output, secrets);
}

}  // namespace axlecast::tsubaki_sc
