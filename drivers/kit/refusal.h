#pragma once

#include <memory>
#include <optional>
#include <string>
#include <variant>

#include "core/device/device.h"
#include "drivers/kit/command_runner.h"

namespace axlecast {

// What every device refuses in the same words. Nothing when there is no reason.

// An order that comes while another is carried out, too late, or without a link.
[[nodiscard]] std::optional<Outcome> RefusalToBegin(bool busy, const DriverCommand& order, MonoNs now,
                                                    bool link_up);

// One that wants the shaft to stand still.
[[nodiscard]] std::optional<Outcome> RefusalInMotion(const Motion& motion);

// A procedure that carries out an order, or why there is none.
template <typename Procedure>
using Made = std::variant<std::unique_ptr<Procedure>, Outcome>;
template <typename Procedure>
[[nodiscard]] std::optional<Outcome> RefusalOf(const Made<Procedure>& made) {
  const Outcome* refused = std::get_if<Outcome>(&made);
  return refused == nullptr ? std::nullopt : std::optional(*refused);
}

// The same refusal as an error, without the words that RefusedOutcome puts before it.
[[nodiscard]] Result<> AsResult(const std::optional<Outcome>& refusal);

}  // namespace axlecast
