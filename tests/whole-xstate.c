/* Preloaded into User-Mode Linux by tests/with-vcan.
 *
 * That kernel (6.1) writes a guest's floating point registers from a buffer of a fixed size. The host refuses a write that is
 * shorter than the processor's state with EFAULT; with AMX tiles the state takes 11,008 bytes, and the guest ends before its
 * init: "userspace - ptrace set fp regs failed, errno = 14". Here the missing end is read from the registers first, so that
 * it keeps its value. A write of the full length passes unchanged. */
#include <elf.h>
#include <errno.h>
#include <stdarg.h>
#include <string.h>
#include <sys/ptrace.h>
#include <sys/syscall.h>
#include <sys/uio.h>
#include <unistd.h>

/* The state of every x86-64 processor so far is shorter. */
enum { LARGEST_STATE = 1 << 16 };

static long write_registers(long pid, long set, struct iovec *given)
{
    static char whole[LARGEST_STATE];
    struct iovec own = { whole, sizeof whole };
    if (syscall(SYS_ptrace, PTRACE_GETREGSET, pid, set, &own) == 0 && own.iov_len > given->iov_len) {
        memcpy(whole, given->iov_base, given->iov_len);
        given = &own;
    }
    return syscall(SYS_ptrace, PTRACE_SETREGSET, pid, set, given);
}

/* The system call returns the word of a PEEK through its last argument, the function as its value. */
static long peek(long request, long pid, void *address)
{
    long word;
    if (syscall(SYS_ptrace, request, pid, address, &word) != 0)
        return -1;
    errno = 0;
    return word;
}

long ptrace(enum __ptrace_request request, ...)
{
    va_list rest;
    va_start(rest, request);
    long pid = va_arg(rest, long);
    void *address = va_arg(rest, void *);
    void *data = va_arg(rest, void *);
    va_end(rest);

    switch (request) {
    case PTRACE_SETREGSET:
        if ((long)address == NT_X86_XSTATE)
            return write_registers(pid, (long)address, data);
        break;
    case PTRACE_PEEKTEXT:
    case PTRACE_PEEKDATA:
    case PTRACE_PEEKUSER:
        return peek(request, pid, address);
    default:
        break;
    }
    return syscall(SYS_ptrace, request, pid, address, data);
}
