#include "platform/os/terminal_output.h"

#include <unistd.h>

#include "core/base/safe_text.h"

namespace axlecast {

TerminalBuffer::~TerminalBuffer() {
  const std::string rest = TerminalText(unfinished_);
  to_->sputn(rest.data(), static_cast<std::streamsize>(rest.size()));
}

bool TerminalBuffer::Pass(std::string_view text) {
  const std::scoped_lock lock(mutex_);
  const std::string all = unfinished_ + std::string(text);
  const std::size_t whole = all.size() - UnfinishedBytes(all);
  unfinished_ = all.substr(whole);
  const std::string safe = TerminalText(std::string_view(all).substr(0, whole));
  const auto size = static_cast<std::streamsize>(safe.size());
  return to_->sputn(safe.data(), size) == size;
}

TerminalBuffer::int_type TerminalBuffer::overflow(int_type character) {
  if (traits_type::eq_int_type(character, traits_type::eof())) return traits_type::not_eof(character);
  const char one = traits_type::to_char_type(character);
  return Pass({&one, 1}) ? character : traits_type::eof();
}

std::streamsize TerminalBuffer::xsputn(const char* text, std::streamsize size) {
  return Pass({text, static_cast<std::size_t>(size)}) ? size : 0;
}

TerminalOutput::TerminalOutput()
    : out_(std::cout.rdbuf()), err_(std::cerr.rdbuf()), safe_out_(out_), safe_err_(err_) {
  std::cout.rdbuf(&safe_out_);
  std::cerr.rdbuf(&safe_err_);
}

TerminalOutput::~TerminalOutput() {
  std::cout.flush();
  std::cout.rdbuf(out_);
  std::cerr.rdbuf(err_);
}

void SteerTerminal(std::string_view sequence) {
  std::cerr.flush();
  [[maybe_unused]] const ssize_t written = write(STDERR_FILENO, sequence.data(), sequence.size());
}

}  // namespace axlecast
