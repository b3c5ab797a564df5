// SPDX-License-Identifier: Apache-2.0
#include "tools/commands/exit_message.h"

#include "cuda/error.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cerrno>
#include <filesystem>
#include <new>
#include <stdexcept>
#include <system_error>

namespace shadowdag {

using testing::HasSubstr;
using testing::Not;

TEST(ExitMessage, AnErrorKeepsItsMessageAndItsKind) {
    for (const ErrorKind kind :
         {ErrorKind::kUsage, ErrorKind::kInput, ErrorKind::kResource, ErrorKind::kDevice}) {
        const ExitMessage exit = exitMessageOf(Error(kind, "a.glb: is empty"));
        EXPECT_EQ(exit.status, int(kind));
        EXPECT_EQ(exit.message, "a.glb: is empty");
    }
}

TEST(ExitMessage, AMistakeInTheProgramIsNotReportedAsBadInput) {
    for (const ExitMessage& exit : {exitMessageOf(std::logic_error("pairs differ")),
                                    exitMessageOf(std::out_of_range("pairs differ"))}) {
        EXPECT_EQ(exit.status, 6);
        EXPECT_THAT(exit.message, HasSubstr("a defect of shadowdag"));
        EXPECT_THAT(exit.message, HasSubstr("pairs differ"));
    }
}

TEST(ExitMessage, AThreadThatCannotBeMadeIsAResourceError) {
    const ExitMessage exit = exitMessageOf(
        std::system_error(std::make_error_code(std::errc::resource_unavailable_try_again)));
    EXPECT_EQ(exit.status, int(ErrorKind::kResource));
    EXPECT_THAT(exit.message, HasSubstr("ulimit -v"));
    EXPECT_THAT(exit.message, HasSubstr("--threads"));
    // As oneTBB says it.
    EXPECT_EQ(exitMessageOf(std::runtime_error("pthread_create has failed: no")).status,
              int(ErrorKind::kResource));
}

TEST(ExitMessage, MissingMemoryIsAResourceErrorAndLibraryExceptionsAreBadInput) {
    EXPECT_EQ(exitMessageOf(std::bad_alloc()).status, int(ErrorKind::kResource));
    EXPECT_THAT(exitMessageOf(std::bad_alloc()).message, HasSubstr("--resolution"));
    const ExitMessage exit = exitMessageOf(std::runtime_error("unexpected end"));
    EXPECT_EQ(exit.status, int(ErrorKind::kInput));
    EXPECT_EQ(exit.message, "unexpected end");
}

TEST(ExitMessage, AFullDiskIsAResourceErrorWhicheverLibraryReportsIt) {
    for (const int code : {ENOSPC, EDQUOT, EFBIG, EIO, EROFS, EMFILE}) {
        const std::error_code error(code, std::generic_category());
        EXPECT_EQ(exitMessageOf(std::filesystem::filesystem_error("report", error)).status,
                  int(ErrorKind::kResource))
            << code;
    }
    EXPECT_EQ(exitMessageOf(std::filesystem::filesystem_error(
                                "report", std::make_error_code(std::errc::not_a_directory)))
                  .status,
              int(ErrorKind::kInput));
}

TEST(ExitMessage, TooManyOpenFilesAreAResourceErrorWhicheverLibraryReportsThem) {
    for (const ExitMessage& exit :
         {exitMessageOf(std::runtime_error("a.exr: Too many open files")),
          exitMessageOf(std::filesystem::filesystem_error(
              "report", std::make_error_code(std::errc::too_many_files_open))),
          exitMessageOf(std::filesystem::filesystem_error(
              "report", std::make_error_code(std::errc::too_many_files_open_in_system)))}) {
        EXPECT_EQ(exit.status, int(ErrorKind::kResource));
        EXPECT_THAT(exit.message,
                    HasSubstr("raise the limit of the shell (ulimit -n), or close some programs"));
        EXPECT_THAT(exit.message, Not(HasSubstr("disk space")));
    }
}

} // namespace shadowdag
