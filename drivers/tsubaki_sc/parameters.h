#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/device/device.h"
#include "core/device/parameter.h"
#include "drivers/tsubaki_sc/readout.h"

namespace axlecast::tsubaki_sc {

// The 55 settings of guideline 11, in the order of their addresses 0 to 54.
[[nodiscard]] std::span<const ParameterSpec> Parameters();
// Returns null if no parameter has this name.
[[nodiscard]] const ParameterSpec* FindParameter(std::string_view name);

// A parameter and the value that it shall have, or has.
struct ParameterValue {
  const ParameterSpec* parameter = nullptr;
  std::uint16_t value = 0;
};

// The blocks of kParameterBlocks that hold these parameters, in order.
[[nodiscard]] std::vector<Block> BlocksOf(const std::vector<ParameterValue>& parameters);
// A parameter's register, from a reader of such blocks.
[[nodiscard]] std::uint16_t ValueIn(const BlockReader& read, const ParameterSpec& parameter);

// read_parameter and read_parameters: some parameters with their values, or all 55 registers.
class ParameterRead final : public Procedure {
 public:
  // No parameters: all of them. With `expected` it looks whether they hold these values: the change `finding`.
  ParameterRead(const Requests& requests, std::vector<ParameterValue> parameters, bool expected);

  [[nodiscard]] Exchange Next() const override { return reader_.Next(); }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;

 private:
  [[nodiscard]] Outcome ShowAll() const;
  [[nodiscard]] Outcome ShowSome() const;

  const std::vector<ParameterValue> parameters_;
  const bool expected_;
  BlockReader reader_;
};

// write_parameter and write_parameters: reads the parameters, writes those that differ, neighbours in one request,
// and reads all of them back. No write is repeated: the reading shows the result.
class ParameterWrite final : public Procedure {
 public:
  // In the order of their addresses, each once.
  ParameterWrite(const Requests& requests, std::vector<ParameterValue> values, DeviceOutput& output);

  [[nodiscard]] Exchange Next() const override;
  void OnStarted() override { sent_ = sent_ || stage_ == Stage::kWrite; }
  void OnLoggedOut() override { sent_ = written_ > 0; }
  std::optional<Outcome> OnAnswer(const Answer& answer) override;
  [[nodiscard]] Outcome GiveUp(std::int32_t reason, const std::string& cause) const override;
  [[nodiscard]] bool touched() const override { return sent_; }

 private:
  enum class Stage : std::uint8_t { kBefore, kWrite, kAfter };

  std::optional<Outcome> OnRead(const Answer& answer);
  std::optional<Outcome> OnWritten(const Answer& answer);
  std::optional<Outcome> NextRun(std::size_t from);
  [[nodiscard]] Outcome Done() const;
  [[nodiscard]] bool Differs(std::size_t index) const { return before_[index] != values_[index].value; }
  [[nodiscard]] Outcome WithChanges(Outcome outcome, const std::vector<std::uint16_t>* after) const;

  const Requests& requests_;
  const std::vector<ParameterValue> values_;
  DeviceOutput& output_;
  BlockReader reader_;
  Stage stage_ = Stage::kBefore;
  std::vector<std::uint16_t> before_;
  std::size_t run_ = 0;  // the values [run_, run_end_) go out together
  std::size_t run_end_ = 0;
  std::vector<std::uint16_t> registers_;  // of the run
  std::size_t written_ = 0;
  bool sent_ = false;
  std::string refusal_;  // of a write: the others are not sent
};

}  // namespace axlecast::tsubaki_sc
