#include "tools/doctor/symptom.h"

#include <utility>

#include "tools/doctor/host/host_files.h"

namespace axlecast {
namespace {

// Quotes the text so that a shell reads it as one word.
std::string ShellWord(const std::string& text) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./:=@%+,";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (const char c : text) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

}  // namespace

Fix Run(std::vector<std::string> words) {
  return {.kind = Fix::Kind::kRun, .words = std::move(words), .path = {}, .text = {}};
}

Fix Write(std::string path, std::string text) {
  return {.kind = Fix::Kind::kWrite, .words = {}, .path = std::move(path), .text = std::move(text)};
}

Fix Append(std::string path, std::string text) {
  return {.kind = Fix::Kind::kAppend, .words = {}, .path = std::move(path), .text = std::move(text)};
}

Fix Manual(std::string text) {
  return {.kind = Fix::Kind::kManual, .words = {}, .path = {}, .text = std::move(text)};
}

std::string LineOf(const Fix& fix) {
  switch (fix.kind) {
    case Fix::Kind::kRun: {
      std::string line;
      for (const std::string& word : fix.words) line += (line.empty() ? "" : " ") + ShellWord(word);
      return line;
    }
    case Fix::Kind::kWrite:
      return "echo " + ShellWord(fix.text) + " > " + ShellWord(fix.path);
    case Fix::Kind::kAppend:
      return "echo " + ShellWord(fix.text) + " >> " + ShellWord(fix.path);
    case Fix::Kind::kManual:
      break;
  }
  return fix.text;
}

std::string_view SeverityName(Severity severity) {
  switch (severity) {
    case Severity::kError:
      return "error";
    case Severity::kWarning:
      return "warning";
    case Severity::kAdvice:
      break;
  }
  return "advice";
}

Result<> ApplyFix(const Fix& fix, const HostFiles& files) {
  switch (fix.kind) {
    case Fix::Kind::kRun:
      if (Result<std::string> output = RunProgram(fix.words); !output) return Failure(std::move(output.error()));
      break;
    case Fix::Kind::kWrite:
      return WriteValue(files.Place(fix.path), fix.text);
    case Fix::Kind::kAppend:
      return AppendLine(files.Place(fix.path), fix.text);
    case Fix::Kind::kManual:
      break;
  }
  return {};
}

}  // namespace axlecast
