#include <algorithm>
#include <memory>
#include <optional>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

#include "core/device/device.h"
#include "core/device/operation.h"
#include "drivers/cia406/cia406.h"
#include "drivers/cia406/interpreter.h"
#include "drivers/cia406/procedures.h"
#include "drivers/kit/arguments.h"
#include "drivers/kit/command_runner.h"
#include "drivers/protocol/canopen/canopen.h"

namespace axlecast::cia406 {
namespace {

using Made = Result<std::unique_ptr<Procedure>>;

constexpr std::string_view kZero = "zero";
constexpr std::string_view kSetPosition = "set_position";
constexpr std::string_view kReadPosition = "read_position";
constexpr std::string_view kReadIdentity = "read_identity";
constexpr std::string_view kReadState = "read_state";
constexpr std::string_view kSave = "save_parameters";

constexpr MonoNs kReadTimeout = 2 * kSecond;
constexpr int kMaxObjects = 5;  // of one readout
// A full queue empties within some frames, or not at all while no node acknowledges.
constexpr MonoNs kQueueFull = 100 * kMillisecond;
// The interval of SYNC on a bus from which nothing is received.
constexpr MonoNs kIdleSync = 200 * kMillisecond;

// Returns the preset value that an operation writes; nothing if it writes no preset, or if its counts are wrong.
std::optional<std::uint32_t> TargetOf(std::string_view operation, const Arguments& arguments,
                                      const Cia406Settings& settings) {
  if (operation == kZero) return 0;
  if (operation != kSetPosition) return std::nullopt;
  const std::int64_t maximum = (std::int64_t{1} << settings.total_bits()) - 1;
  const std::optional<std::int64_t> value = WholeArgument(arguments, "counts", 0, maximum);
  return value ? std::optional(static_cast<std::uint32_t>(*value)) : std::nullopt;
}

// One standard encoder on a CAN bus: selects what is sent, and when; otherwise it listens. The Interpreter evaluates the
// frames.
class Cia406Device final : public CommandDevice<Procedure> {
 public:
  Cia406Device(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output)
      : CommandDevice(device.settings, Operations(), output),
        settings_(Own(device)),
        produces_sync_(ProducesSync(bus, device)),
        interpreter_(bus, device, output) {}

  [[nodiscard]] Step Next(const BusSlot& slot) const override {
    if (!link_up_) return {.action = Idle{kNever}, .priority = Priority::kLive};
    if (slot.now < hold_until_) return {.action = Listen{hold_until_}, .priority = Priority::kLive};
    if (SyncIsDue(slot))
      return {.action = Send{.frame = SyncFrame(), .for_all = true}, .priority = Priority::kLive};
    if (const auto urgent = interpreter_.UrgentFrame(slot.now)) {
      return {.action = Send{*urgent}, .priority = Priority::kCommand};
    }
    const std::optional<Transfer> transfer = NextTransfer(slot);
    if (!transfer) return Listening(slot.now);
    return {.action = Send{RequestFrame(settings_.node, transfer->request)}, .priority = transfer->priority};
  }
  void OnStarted(const Step& step, MonoNs now) override {
    runner_.ExpireIfLate(now);
    for_procedure_ = false;
    const auto* send = std::get_if<Send>(&step.action);
    if (send == nullptr) return;
    if (send->frame.id == kSyncId) {
      sync_at_ = now;
      return;
    }
    live_slot_ = step.priority == Priority::kCommand;
    const std::optional<SdoRequest> own = ProcedureRequest(now);
    if (!live_slot_ || !own || send->frame.id != kSdoRequestId + settings_.node) return;
    const std::optional<SdoRequest> request = ParseRequest(send->frame.data);
    for_procedure_ = request && request->object == own->object && request->write == own->write;
    if (!for_procedure_) return;
    // A procedure that changes something has not begun with its first read: it can still expire.
    if (runner_.procedure().reads_only()) runner_.OnStarted(true);
    runner_.procedure().OnStarted(*own, now);
  }
  void On(const Event& event) override {
    const MonoNs now = event.received.last;
    switch (event.kind) {
      case Event::Kind::kLinkUp:
        link_up_ = true;
        hold_until_ = 0;
        interpreter_.OnLinkUp(now);
        break;
      case Event::Kind::kLinkDown:
        OnLinkDown(now);
        break;
      default:
        if (event.kind == Event::Kind::kNotSent) OnNotSent(event);
        if (runner_.busy() && interpreter_.IsBootUp(event)) runner_.procedure().OnRestarted();
        AdvanceProcedure(interpreter_.Evaluate(event), now);
        break;
    }
  }
  void Begin(const DriverCommand& command, MonoNs now) override {
    if (runner_.Begin(command, link_up_, now)) live_slot_ = false;
  }
  [[nodiscard]] bool Cancel(const CommandId& id, MonoNs) override {
    if (!runner_.Cancel(id)) return false;
    for_procedure_ = false;
    return true;
  }

 private:
  [[nodiscard]] Result<std::unique_ptr<Procedure>> MakeProcedure(const DriverCommand& command,
                                                                 MonoNs now) const override {
    const MonoNs deadline = now + kReadTimeout + kMaxObjects * settings_.sdo_timeout;
    if (command.operation == kZero || command.operation == kSetPosition) {
      const auto target = TargetOf(command.operation, command.arguments, settings_);
      if (!target) {
        return BadArgument(
            Text("counts must be a whole number, 0 to 2^%d - 1 (6002h): turns and single-turn together",
                 settings_.total_bits()));
      }
      return std::make_unique<PresetProcedure>(*target, settings_, output_, now);
    }
    if (command.operation == kReadPosition) {
      const auto after = AfterArgument(command.arguments);
      const auto target = after ? TargetOf(after->operation, after->arguments, settings_) : std::nullopt;
      if (after && !target) return BadArgument("after must be zero, or \"set_position counts=N\" with its counts");
      return ReadPosition(target, settings_, output_, deadline);
    }
    if (command.operation == kReadIdentity) return ReadIdentity(deadline);
    if (command.operation == kReadState) return ReadState(interpreter_, deadline);
    if (command.operation == kSave) return std::make_unique<SaveProcedure>(settings_, now);
    return UnknownOperation("model cia406", command.operation);
  }
  [[nodiscard]] Result<> CheckState(const DriverCommand&, MonoNs) const override {
    if (interpreter_.running()) return {};
    return DeviceOffline(
        "nothing is received from the encoder, or it is not identified yet: check its power, its cable and node "
        "id");
  }
  [[nodiscard]] bool SyncIsDue(const BusSlot& slot) const {
    if (!produces_sync_ || !slot.poll_due) return false;
    return interpreter_.BusIsAlive(slot.now) || slot.now - sync_at_ >= kIdleSync;
  }
  // The next transfer, and its priority.
  struct Transfer {
    SdoRequest request;
    Priority priority = Priority::kSlow;
  };
  [[nodiscard]] std::optional<Transfer> NextTransfer(const BusSlot& slot) const {
    if (!interpreter_.client().free()) return std::nullopt;
    const auto reading = [](ObjectId object, Priority priority) {
      return Transfer{.request = {.object = object, .write = {}}, .priority = priority};
    };
    if (const auto first = interpreter_.FirstObject(slot.now)) return reading(*first, Priority::kSlow);
    if (interpreter_.client().fence() || !interpreter_.running()) return std::nullopt;
    const bool live = settings_.mode == Mode::kPolled && slot.poll_due;
    const std::optional<SdoRequest> own = ProcedureRequest(slot.now);
    if (own && (!live || !live_slot_)) return Transfer{*own, Priority::kCommand};
    if (live) return reading(kPosition, Priority::kLive);
    if (const auto diagnostic = interpreter_.DiagnosticObject(slot.now))
      return reading(*diagnostic, Priority::kSlow);
    return std::nullopt;
  }
  // Returns the transfer that the procedure needs next; nothing without a procedure, or if it has expired.
  [[nodiscard]] std::optional<SdoRequest> ProcedureRequest(MonoNs now) const {
    const Procedure* procedure = runner_.Runnable(now);
    return procedure == nullptr ? std::nullopt : procedure->NextRequest(now);
  }
  [[nodiscard]] Step Listening(MonoNs now) const {
    MonoNs until = interpreter_.Due(now);
    if (runner_.busy()) until = std::min({until, runner_.procedure().Due(now), runner_.ExpiresAt()});
    return {.action = Listen{std::max(until, now)}, .priority = Priority::kLive};
  }
  void OnLinkDown(MonoNs now) {
    link_up_ = false;
    for_procedure_ = false;
    interpreter_.OnLinkDown(now);
    runner_.OnLinkLost();
  }
  // The queue of the controller is full, whichever device the frame was for: the next frame would not fit either.
  void OnNotSent(const Event& event) {
    hold_until_ = event.received.last + kQueueFull;
    if (std::exchange(for_procedure_, false) && runner_.busy()) runner_.procedure().OnNotSent();
  }
  void AdvanceProcedure(const std::optional<SdoResult>& result, MonoNs now) {
    if (!runner_.busy() || runner_.ExpireIfLate(now)) return;
    if (result && runner_.Report(runner_.procedure().OnResult(*result))) return;
    runner_.Report(runner_.procedure().OnTime(now));
  }

  const Cia406Settings& settings_;
  const bool produces_sync_;
  Interpreter interpreter_;

  MonoNs hold_until_ = 0;       // the controller's queue is full
  MonoNs sync_at_ = 0;          // of the last SYNC
  bool live_slot_ = false;      // the last slot was the procedure's: a live reading that is due goes first
  bool for_procedure_ = false;  // the request that is being sent is the procedure's
};

}  // namespace

std::vector<AlarmSpec> Alarms() {
  std::vector<AlarmSpec> alarms = {kWrongEncoder, kHeartbeatLost, kNotOperational,
                                   kSecondSync,   kPeriodDiffers, kMoreEmergencies};
  for (const DiagnosticAlarm& alarm : kAlarmTable) alarms.push_back(alarm.spec);
  for (const DiagnosticAlarm& alarm : kWarningTable) alarms.push_back(alarm.spec);
  for (const ClassAlarm& kind : kClasses) {
    const AlarmSpec alarm = EmergencyAlarm(static_cast<std::uint16_t>(kind.first << 8));
    const bool is_new = std::none_of(alarms.begin(), alarms.end(), [&alarm](const AlarmSpec& each) {
      return std::string_view(each.name) == alarm.name;
    });
    if (is_new) alarms.push_back(alarm);
  }
  return alarms;
}

std::span<const OperationSpec> Operations() {
  static const std::vector<OperationSpec> kSpecs = {
      // Some makers' encoders keep a preset at once.
      MovingDatum({.name = kZero,
                   .help = "Make the present shaft angle the encoder's 0, turns too: preset value 6003h",
                   .verification = "a reading shows 0 +- 0.2 degrees (or 2 counts), if it read otherwise before",
                   .verified_by_operation = kReadPosition}),
      MovingDatum({.name = kSetPosition,
                   .help = "Make the encoder read this position at the present shaft angle: preset value 6003h",
                   .arguments = {{"counts", "turns and single-turn together, 0 to the total range - 1"}},
                   .verification = "a reading shows it, +- 0.2 degrees (or 2 counts), if it read otherwise before",
                   .verified_by_operation = kReadPosition}),
      {.name = kReadPosition,
       .help = "Read the position once",
       .arguments = {{"after", "an operation, to see whether it took effect: zero, set_position counts=N", false}},
       .reads_only = true,
       .verification = "the reading itself"},
      {.name = kReadIdentity,
       .help = "Read device type, vendor, product, revision and serial number (1000h, 1018h)",
       .reads_only = true,
       .verification = "the reading itself"},
      {.name = kReadState,
       .help = "Show NMT state, error register, operating status, alarms, warnings and the last emergency message",
       .reads_only = true,
       .verification = "the reading itself"},
      {.name = kSave,
       .help = "Make the encoder store its parameters, including a preset (1010h sub 1)",
       .destructive = true,
       .writes = &OneWrite,
       .verification = "the encoder's confirmation"},
  };
  return kSpecs;
}

std::unique_ptr<Device> MakeDevice(const BusConfig& bus, const DeviceConfig& device, DeviceOutput& output) {
  return std::make_unique<Cia406Device>(bus, device, output);
}

}  // namespace axlecast::cia406
