/* The bytes of default_body.npz, between two symbols. */
    .section .rodata
    .global simulcap_default_body_begin
    .global simulcap_default_body_end
    .balign 16
simulcap_default_body_begin:
    .incbin DEFAULT_BODY_NPZ
simulcap_default_body_end:
    .byte 0
    .section .note.GNU-stack,"",@progbits
