/* Embeds the fitted pose prior; found through the include path (the top of the tree). */
    .section .rodata
    .balign 16
    .global simulcapCmuPosePrior
    .global simulcapCmuPosePriorEnd
simulcapCmuPosePrior:
    .incbin "avatar/io/data/cmu_pose_prior.npz"
simulcapCmuPosePriorEnd:
    .byte 0
    .section .note.GNU-stack,"",%progbits
