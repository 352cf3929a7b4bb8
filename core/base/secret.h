#pragma once

#include <string>
#include <string_view>
#include <utility>

#include "core/base/result.h"

namespace axlecast {

// A text that must not be shown anywhere, for example a password. Its memory is overwritten when it is destroyed.
class Secret {
 public:
  Secret() = default;
  explicit Secret(std::string text) : text_(std::move(text)) {}
  // Copied and wiped: a moved-from short string may keep its characters.
  // NOLINTNEXTLINE(performance-move-constructor-init)
  Secret(Secret&& other) noexcept : text_(other.text_) { other.Wipe(); }
  Secret& operator=(Secret&& other) noexcept {
    if (this == &other) return *this;
    Wipe();
    text_ = other.text_;
    other.Wipe();
    return *this;
  }
  ~Secret() { Wipe(); }

  [[nodiscard]] std::string_view text() const { return text_; }

 private:
  void Wipe();

  std::string text_;
};

// The place of a secret: a file that only its owner can read, or a systemd credential.
struct SecretPlace {
  std::string file;             // absolute path, mode 0600 or 0400
  std::string credential;       // name below $CREDENTIALS_DIRECTORY (systemd.exec(5), LoadCredential=)
  bool group_may_read = false;  // the file's mode may be 0640 or 0440 as well

  [[nodiscard]] bool empty() const { return file.empty() && credential.empty(); }
};

// Reads secrets when they are needed. platform/os/secret_file.h reads files and credentials; tests use their own.
class SecretSource {
 public:
  virtual ~SecretSource() = default;

  // Reads the content without its last newline. An error never contains the content.
  [[nodiscard]] virtual Result<Secret> Read(const SecretPlace& place) = 0;
};

// Overwrites what functions that have returned left on the calling thread's stack, 64 KiB of it. Compilers spill copies
// of what passes through registers; a password that was handled is wiped nowhere else.
void WipeStack();

}  // namespace axlecast
