#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>

namespace axlecast::tsubaki_sc::simulator {

// The 16 characters of a login or password write, and whether they can be a password: 8 to 16 characters of
// 0x21..0x7E, the rest NUL or SP (guideline 11).
using Characters = std::array<std::uint8_t, 16>;
struct WrittenPassword {
  bool length_fits = false;     // what stands before the padding is 8 to 16 characters long
  bool characters_fit = false;  // and holds only what a password may hold
  std::string text;
};
[[nodiscard]] WrittenPassword Unpadded(const Characters& characters);

// Who may write. The login is lost with the power; the password is not.
class Access {
 public:
  // The right password logs in, or out of a login; another one changes nothing: false.
  [[nodiscard]] bool Authenticate(std::string_view password);
  void LogOut() { logged_in_ = false; }
  [[nodiscard]] bool logged_in() const { return logged_in_; }

  void SetPassword(std::string password) { password_ = std::move(password); }
  [[nodiscard]] Characters password() const;  // NUL behind it

 private:
  std::string password_ = "password";  // guideline 2
  bool logged_in_ = false;
};

}  // namespace axlecast::tsubaki_sc::simulator
