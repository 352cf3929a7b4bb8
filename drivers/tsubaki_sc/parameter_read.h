#pragma once

#include <optional>
#include <string>
#include <vector>

#include "drivers/tsubaki_sc/parameter_set.h"

namespace axlecast::tsubaki_sc {

// read_parameter and read_parameters: some parameters with their values, or all 55 as they stand in the registers.
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

}  // namespace axlecast::tsubaki_sc
