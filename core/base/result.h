#pragma once

#include <cstdint>
#include <string>
#include <tl/expected.hpp>
#include <utility>

namespace axlecast {

// Why an operation failed, in words for an operator: what happened, why, and what to type or change.
struct Error {
  std::string text;
  std::int32_t reason = 0;  // command_status_t REASON_* if a command is refused; 0 elsewhere
};

// The value of a function that can fail, or its error. Result<> holds no value.
//
//   Result<Frame> frame = Read(port);
//   if (!frame) return Failure(frame.error());
//   Use(*frame);
template <typename T = void>
using Result = tl::expected<T, Error>;

// Returns the error of a Result of any type.
[[nodiscard]] inline tl::unexpected<Error> Failure(Error error) { return tl::unexpected<Error>(std::move(error)); }
[[nodiscard]] inline tl::unexpected<Error> Failure(std::string text, std::int32_t reason = 0) {
  return Failure(Error{std::move(text), reason});
}

// Returns the text of the error; empty if the function succeeded.
template <typename T>
[[nodiscard]] std::string ErrorText(const Result<T>& result) {
  return result ? std::string() : result.error().text;
}

}  // namespace axlecast
