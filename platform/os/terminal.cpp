#include "platform/os/terminal.h"

#include <fcntl.h>
#include <signal.h>
#include <termios.h>
#include <unistd.h>

#include <array>
#include <cerrno>

#include "core/base/text.h"

namespace axlecast {
namespace {

// Signals that end a process without unwinding it.
constexpr std::array kEnding = {SIGHUP, SIGQUIT, SIGABRT, SIGSEGV, SIGBUS, SIGFPE, SIGILL};

// The state of the only object, for its signal handlers.
termios before{};
termios key_by_key{};
std::array<struct sigaction, kEnding.size()> ending_before{};
struct sigaction stop_before {};
struct sigaction continue_before {};

// Setting a terminal from the background would stop the process.
bool InForeground() { return tcgetpgrp(STDIN_FILENO) == getpgrp(); }

void SetTerminal(const termios& mode) {
  if (InForeground()) tcsetattr(STDIN_FILENO, TCSADRAIN, &mode);
}

// Executes the default action of the signal that is being handled.
void ActByDefault(int number) {
  struct sigaction action {};
  action.sa_handler = SIG_DFL;
  sigaction(number, &action, nullptr);
  sigset_t set;
  sigemptyset(&set);
  sigaddset(&set, number);
  raise(number);
  pthread_sigmask(SIG_UNBLOCK, &set, nullptr);
}

void OnEnding(int number) {
  SetTerminal(before);
  ActByDefault(number);
}

void Catch(int number, void (*handler)(int), struct sigaction* old) {
  struct sigaction action {};
  action.sa_handler = handler;
  action.sa_flags = SA_RESTART;
  sigaction(number, &action, old);
}

// Catches a signal that would end the process. One that is ignored, or has a handler that continues (SIGBUS of mapped files),
// keeps its action.
void CatchEnding(int number, struct sigaction& old) {
  sigaction(number, nullptr, &old);
  const bool ends = (old.sa_flags & SA_SIGINFO) == 0 && old.sa_handler == SIG_DFL;
  if (ends) Catch(number, &OnEnding, nullptr);
}

void OnStop(int number) {
  const int saved = errno;
  SetTerminal(before);
  ActByDefault(number);  // returns when the process continues
  Catch(SIGTSTP, &OnStop, nullptr);
  errno = saved;
}

void OnContinue(int) {
  const int saved = errno;
  SetTerminal(key_by_key);
  errno = saved;
}

}  // namespace

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

bool TerminalKeys::Usable() { return isatty(STDIN_FILENO) == 1 && InForeground(); }

TerminalKeys::TerminalKeys() {
  if (!Usable() || tcgetattr(STDIN_FILENO, &before) != 0) return;
  // Opened again, because O_NONBLOCK on standard input would also affect the shell.
  file_ = Descriptor(open("/dev/tty", O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC));
  if (!file_.valid()) return;
  taken_ = true;
  key_by_key = before;
  key_by_key.c_lflag &= ~static_cast<tcflag_t>(ICANON | ECHO);
  key_by_key.c_cc[VMIN] = 1;
  key_by_key.c_cc[VTIME] = 0;
  for (std::size_t i = 0; i < kEnding.size(); ++i) CatchEnding(kEnding[i], ending_before[i]);
  Catch(SIGTSTP, &OnStop, &stop_before);
  Catch(SIGCONT, &OnContinue, &continue_before);
  SetTerminal(key_by_key);
}

TerminalKeys::~TerminalKeys() {
  if (!taken_) return;
  SetTerminal(before);
  for (std::size_t i = 0; i < kEnding.size(); ++i) sigaction(kEnding[i], &ending_before[i], nullptr);
  sigaction(SIGTSTP, &stop_before, nullptr);
  sigaction(SIGCONT, &continue_before, nullptr);
}

std::string TerminalKeys::Read() {
  std::array<char, 64> keys;
  const ssize_t size = file_.valid() ? read(file_.get(), keys.data(), keys.size()) : 0;
  if (size > 0) return {keys.data(), static_cast<std::size_t>(size)};
  if (size == 0 || (errno != EAGAIN && errno != EINTR)) file_.Reset();  // hung up
  return "";
}

}  // namespace axlecast
