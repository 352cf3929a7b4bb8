#include <gmock/gmock.h>

#include <axlecast/command_status_t.hpp>
#include <set>

#include "core/device/operation.h"
#include "tests/conformance/example_device.h"

// Device::Validate returns the refusal that Begin would report, checks the values of arguments, and changes nothing: on the first
// device of every example bus, for every operation of its family.
namespace axlecast {
namespace {

using S = command_status_t;

constexpr MonoNs kToOnline = 5 * kSecond;

// Values of which some fit each argument of each family.
constexpr const char* kValues[] = {"1",     "0",     "72",    "20", "9600", "500000",       "positive",
                                   "A1 05", "usual", "spare", "10", "zero", "log_interval", "only_one_connected"};

std::string TextOf(const DriverCommand& order) {
  std::string text = order.operation;
  for (const auto& [key, value] : order.arguments) text += ' ' + key + "='" + value + '\'';
  return text;
}

std::optional<Outcome> RefusalOf(const ExampleDevice& rig, const DriverCommand& command) {
  const Result<> valid = rig.device->Validate(command, rig.clock.Now());
  return valid ? std::nullopt : std::optional(RefusedOutcome(valid.error()));
}

// Validates, then begins: both must give the same refusal. Returns the refusal, if any; else the command is being carried out.
std::optional<Outcome> AskAndBegin(ExampleDevice& rig, const DriverCommand& order) {
  SCOPED_TRACE(TextOf(order));
  const std::size_t told = rig.output.outcomes.size();
  auto refusal = RefusalOf(rig, order);
  EXPECT_EQ(rig.output.outcomes.size(), told);
  const auto again = RefusalOf(rig, order);
  EXPECT_EQ(again.has_value(), refusal.has_value()) << "asking changed something";
  const auto begun = rig.Begin(order);
  EXPECT_EQ(begun.has_value(), refusal.has_value()) << (begun ? begun->text : refusal ? refusal->text : "");
  if (!begun || !refusal) return refusal;
  EXPECT_EQ(begun->state, refusal->state);
  EXPECT_EQ(begun->reason, refusal->reason);
  EXPECT_EQ(begun->text, refusal->text);
  EXPECT_NE(refusal->reason, S::REASON_NONE);
  EXPECT_EQ(refusal->text.rfind("nothing was done: ", 0), 0U) << refusal->text;
  return refusal;
}

// Gives up an order that was taken up, or lets it come to its end.
void Release(ExampleDevice& rig, const DriverCommand& order) {
  if (!rig.device->Cancel(order.id, rig.clock.Now())) rig.Finish(order.id);
}

bool Fits(ExampleDevice& rig, const OperationSpec& operation, const Arguments& arguments) {
  return !RefusalOf(rig, rig.MakeOrder(operation.name, arguments));
}

// Adds values for `names` until the device takes the order.
bool Complete(ExampleDevice& rig, const OperationSpec& operation, std::vector<std::string> names,
              Arguments& arguments) {
  if (names.empty()) return Fits(rig, operation, arguments);
  const std::string name = names.back();
  names.pop_back();
  for (const char* value : kValues) {
    arguments.emplace_back(name, value);
    if (Complete(rig, operation, names, arguments)) return true;
    arguments.pop_back();
  }
  return false;
}

// Arguments with which the device takes the operation; nothing when there are none in this configuration.
std::optional<Arguments> GoodArguments(ExampleDevice& rig, const OperationSpec& operation) {
  std::vector<std::string> required;
  for (const ArgumentSpec& argument : operation.arguments) {
    if (argument.required) required.emplace_back(argument.name);
  }
  Arguments arguments;
  if (Complete(rig, operation, required, arguments)) return arguments;
  if (!required.empty()) return std::nullopt;
  for (const ArgumentSpec& argument : operation.arguments) {
    if (Complete(rig, operation, {std::string(argument.name)}, arguments)) return arguments;
  }
  return std::nullopt;
}

class RefusalConformance : public ExampleTest {
 protected:
  [[nodiscard]] std::unique_ptr<ExampleDevice> Online() {
    auto rig = std::make_unique<ExampleDevice>(*machine_, *bus_, secrets_);
    rig->Run(kToOnline);
    return rig;
  }
  // For each operation that the device takes, with arguments that it takes.
  template <typename Check>
  void ForEachAccepted(ExampleDevice& rig, Check check) {
    for (const OperationSpec& operation : bus_->family->operations) {
      SCOPED_TRACE(operation.name);
      if (const auto good = GoodArguments(rig, operation)) check(operation, rig.MakeOrder(operation.name, *good));
    }
  }
};

TEST_P(RefusalConformance, GoodOrdersPassAndBadArgumentsAreNamed) {
  const auto rig = Online();
  ForEachAccepted(*rig, [&](const OperationSpec& operation, const DriverCommand& order) {
    for (const ArgumentSpec& argument : operation.arguments) {
      DriverCommand bad = order;
      std::erase_if(bad.arguments, [&](const auto& given) { return given.first == argument.name; });
      bad.arguments.emplace_back(argument.name, "?");
      const auto refusal = AskAndBegin(*rig, bad);
      ASSERT_TRUE(refusal) << argument.name;
      EXPECT_EQ(refusal->reason, S::REASON_BAD_ARGUMENT) << refusal->text;
    }
    EXPECT_FALSE(AskAndBegin(*rig, order));
    Release(*rig, order);
  });
}

TEST_P(RefusalConformance, OrdersWithoutArgumentsAreAnsweredAlike) {
  for (const OperationSpec& operation : bus_->family->operations) {
    const auto rig = Online();
    const DriverCommand order = rig->MakeOrder(operation.name, {});
    if (!AskAndBegin(*rig, order)) Release(*rig, order);
  }
}

TEST_P(RefusalConformance, AMovingShaftIsNamedWithItsSpeed) {
  const auto rig = Online();
  ForEachAccepted(*rig, [&](const OperationSpec& operation, const DriverCommand& order) {
    for (const bool known : {true, false}) {
      rig->output.motion = {.known = known, .standstill = false, .speed_rpm = 12.5};
      const auto refusal = AskAndBegin(*rig, order);
      EXPECT_EQ(refusal.has_value(), operation.needs_standstill);
      if (!refusal) {
        Release(*rig, order);
      } else {
        EXPECT_EQ(refusal->reason, S::REASON_NOT_STANDING_STILL);
        EXPECT_EQ(refusal->text.find("12.5 rpm") != std::string::npos, known) << refusal->text;
      }
      rig->output.motion = AtRest().motion;
    }
  });
}

TEST_P(RefusalConformance, ABusyDeviceSaysSo) {
  const auto& operations = bus_->family->operations;
  for (const OperationSpec& held : operations) {
    const auto rig = Online();
    const auto good = GoodArguments(*rig, held);
    if (!good || held.urgent) continue;
    const DriverCommand order = rig->MakeOrder(held.name, *good);
    const DriverCommand another = rig->MakeOrder(held.name, *good);
    ASSERT_FALSE(AskAndBegin(*rig, order));
    const auto refusal = AskAndBegin(*rig, another);
    ASSERT_TRUE(refusal) << held.name;
    EXPECT_EQ(refusal->reason, S::REASON_BUSY);
  }
}

TEST_P(RefusalConformance, WhatComesTooLateOrWithoutALinkIsRefused) {
  const auto rig = Online();
  std::vector<DriverCommand> orders;
  ForEachAccepted(*rig, [&](const OperationSpec&, const DriverCommand& order) { orders.push_back(order); });
  for (DriverCommand late : orders) {
    late.begin_by = rig->clock.Now() - 1;
    const auto refusal = AskAndBegin(*rig, late);
    ASSERT_TRUE(refusal);
    EXPECT_EQ(refusal->state, CommandState::kExpired);
  }
  rig->TellLink(Event::Kind::kLinkDown);
  for (const DriverCommand& order : orders) {
    const auto refusal = AskAndBegin(*rig, order);
    ASSERT_TRUE(refusal);
    EXPECT_EQ(refusal->reason, S::REASON_DEVICE_OFFLINE);
  }
  rig->TellLink(Event::Kind::kLinkUp);
  for (const DriverCommand& order : orders) {
    if (!AskAndBegin(*rig, order)) Release(*rig, order);
  }
}

// Whether some of many arguments leads to anything but a refusal by the configuration.
bool PassesTheConfiguration(ExampleDevice& rig, const OperationSpec& operation) {
  const auto forbidden = [&](const Arguments& arguments) {
    const auto refusal = RefusalOf(rig, rig.MakeOrder(operation.name, arguments));
    return refusal &&
           (refusal->reason == S::REASON_NOT_PERMITTED || refusal->reason == S::REASON_UNKNOWN_OPERATION);
  };
  if (GoodArguments(rig, operation)) return true;
  return operation.arguments.empty() && !forbidden({});
}

// DEVICE.operations lists what a device takes as it is configured, and nothing else.
TEST_P(RefusalConformance, TheFamilyPermitsWhatTheDeviceTakes) {
  const Family& family = *bus_->family;
  const auto rig = Online();
  for (const OperationSpec& operation : family.operations) {
    SCOPED_TRACE(operation.name);
    const bool permitted =
        family.permits == nullptr || family.permits(*bus_, bus_->devices.front(), operation.name);
    EXPECT_EQ(permitted, PassesTheConfiguration(*rig, operation));
  }
}

// The declaration of an operation holds when it is carried out.
TEST_P(RefusalConformance, NothingIsWrittenOrMovedThatIsNotDeclared) {
  for (const OperationSpec& operation : bus_->family->operations) {
    SCOPED_TRACE(operation.name);
    const auto rig = Online();
    const auto good = GoodArguments(*rig, operation);
    if (!good) continue;
    const int writes = rig->output.nv_writes;
    const int jumps = rig->output.jumps;
    const DriverCommand order = rig->MakeOrder(operation.name, *good);
    ASSERT_FALSE(AskAndBegin(*rig, order));
    rig->Finish(order.id);
    EXPECT_EQ(rig->FinalOutcomes(order.id), 1);
    const bool counted = operation.writes != nullptr;
    if (counted) {
      EXPECT_LE(rig->output.nv_writes - writes, operation.writes(*good));
    }
    // The maker of a monitor states no limit; what is written to it is counted all the same.
    if (!counted && (bus_->family->has_position || operation.reads_only)) {
      EXPECT_EQ(rig->output.nv_writes, writes);
    }
    if (!operation.moves_datum) {
      EXPECT_EQ(rig->output.jumps, jumps);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Family, RefusalConformance, testing::ValuesIn(ExampleBuses()), NameOf);

// So that the tests above leave no operation out.
TEST(Examples, HaveADeviceForEachOperation) {
  FixedSecrets secrets;
  secrets.any = "password";
  std::map<std::string, std::set<std::string>> taken;
  for (const ExampleBus& example : ExampleBuses()) {
    ConfigErrors errors(example.file);
    const auto machine = LoadConfig(example.file, errors);
    ASSERT_TRUE(machine) << errors.Text();
    const BusConfig& bus = *machine->FindBus(example.bus);
    ExampleDevice rig(*machine, bus, secrets);
    rig.Run(kToOnline);
    for (const OperationSpec& operation : bus.family->operations) {
      if (GoodArguments(rig, operation)) taken[example.family].emplace(operation.name);
    }
  }
  for (const Family* family : Families()) {
    for (const OperationSpec& operation : family->operations) {
      EXPECT_TRUE(taken[std::string(family->name)].contains(std::string(operation.name)))
          << family->name << ' ' << operation.name;
    }
  }
}

}  // namespace
}  // namespace axlecast
